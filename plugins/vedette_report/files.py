"""The files of a run. All but the pictures are equal, byte for byte, for equal configs and seeds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from vedette.config import load_plugins, to_config
from vedette.errors import Problem, VedetteError
from vedette.experiment import Experiment, Result
from vedette.space import Space
from vedette.types import Recording
from vedette.writing import whole_bytes, whole_file
from vedette_files import (
    PARQUET,
    Terms,
    write_geojson,
    write_recording,
    write_tracks_csv,
    write_tracks_jsonl,
    write_tracks_parquet,
)


def write_files(folder: Path, experiment: Experiment, result: Result, figures: Mapping[str, Any], text: str) -> list[str]:
    """Write all but pictures; return the names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    space, sensors = experiment.tracker.state, experiment.tracker.sensors
    terms = Terms.of(result.recording.notes)
    write_tracks_csv(folder / "tracks.csv", result.tracks, space, terms)
    write_tracks_jsonl(folder / "tracks.jsonl", result.tracks, space)
    detected = {name: sensors[name].measurement for name in experiment.preprocessors}
    taken = Recording(result.scans, result.recording.truth, (), result.recording.notes, detected=detected)
    write_recording(folder / "recording.jsonl", taken, {name: sensor.measurement for name, sensor in sensors.items()})
    written = ["tracks.csv", "tracks.jsonl", "recording.jsonl", *write_summaries(folder, experiment, figures, text)]
    return [*written, *_in_its_terms(folder, result, space, terms)]


def write_summaries(folder: Path, experiment: Experiment, figures: Mapping[str, Any], text: str) -> list[str]:
    """Write the config, the figures and the summary in words; return the names of the files."""
    texts = {
        "config.json": json.dumps(to_config(experiment), indent=2) + "\n",
        "summary.json": json.dumps(figures, indent=2) + "\n",
        "summary.txt": text,
    }
    return write_texts(folder, texts)


def write_texts(folder: Path, texts: Mapping[str, str]) -> list[str]:
    """Write each text as the file of its name, whole or not at all; return the names."""
    for name, content in texts.items():
        with whole_file(folder / name) as file:
            file.write(content)
    return list(texts)


def _in_its_terms(folder: Path, result: Result, space: Space, terms: Terms) -> list[str]:
    """Write the tracks as their recording came: as a map if it has latitudes, as Parquet if it is; return the names."""
    written = []
    if "latitude" in terms.columns(space):
        write_geojson(folder / "tracks.geojson", result.tracks, terms)
        written.append("tracks.geojson")
    if result.recording.notes.get("table") == PARQUET and find_spec("pyarrow"):
        write_tracks_parquet(folder / "tracks.parquet", result.tracks, space, terms)
        written.append("tracks.parquet")
    return written


def write_series(folder: Path, packed: bytes) -> list[str]:
    """Write the series that a run has collected; return the name of the file."""
    with whole_bytes(folder / "series.npz") as file:
        file.write(packed)
    return ["series.npz"]


def write_of_plugins(
    folder: Path, experiment: Experiment, result: Result, hook: str = "vedette_files"
) -> tuple[list[str], list[Problem]]:
    """Let plugins write their files of a run, by one of their hooks; return the names, and what went wrong."""
    names, problems = [], []
    for plugin in load_plugins()[0]:
        try:
            found = getattr(plugin.hooks, hook)(folder=folder, experiment=experiment, result=result)
            names += [name for written in found for name in written]
        except (OSError, VedetteError):
            raise
        except (Exception, SystemExit) as error:
            problems.append(Problem(str(plugin), f"its {hook} failed: {type(error).__name__}: {error}"))
    return names, problems
