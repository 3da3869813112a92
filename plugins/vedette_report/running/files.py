"""The files of a run. All but the pictures are equal, byte for byte, for equal configs and seeds."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vedette import Experiment, Problem, Recording, Result, VedetteError, to_config
from vedette.config import load_plugins
from vedette_files import Terms, write_recording
from vedette_files.writing import whole_bytes, write_text, write_texts
from vedette_report.running.track_files import TrackFiles
from vedette_report.series.recorder import Recorded

SERIES = "series.npz"

NAMES = (
    *("tracks.csv", "tracks.jsonl", "tracks.geojson", "tracks.parquet", "recording.jsonl", SERIES, "config.json"),
    *("summary.json", "summary.txt", "smoothed.csv", "smoothed.jsonl", "smoothed.npz", "report.html", "episodes.csv"),
)
"""Files that a run may leave, besides pictures and those of plugins."""


def write_files(
    folder: Path, experiment: Experiment, recorded: Recorded, figures: Mapping[str, Any], text: str
) -> list[str]:
    """Write all but pictures of a run that kept all; return the names of the files."""
    folder.mkdir(parents=True, exist_ok=True)
    result, sensors = recorded.result, experiment.tracker.sensors
    notes, space, rows = result.recording.notes, experiment.tracker.state, recorded.rows
    terms = Terms.of(notes, result.tracks)
    with TrackFiles(folder, space, notes, rows.modes.shape[1], terms, extra=rows.extra) as tracks:
        tracks.write(rows)
    detected = {name: sensors[name].measurement for name in experiment.preprocessors}
    recording = result.recording
    taken = Recording(result.scans, recording.truth, (), notes, detected=detected, nobody=recording.nobody)
    write_recording(folder / "recording.jsonl", taken, {name: sensor.measurement for name, sensor in sensors.items()})
    summaries = write_summaries(folder, experiment, figures, text)
    with whole_bytes(folder / SERIES) as file:
        file.write(recorded.packed)
    return [*tracks.names[:2], "recording.jsonl", *summaries, *tracks.names[2:], SERIES]


def write_summaries(folder: Path, experiment: Experiment, figures: Mapping[str, Any], text: str) -> list[str]:
    """Write the config, the figures and the summary in words; return the names of the files."""
    write_config(folder, experiment)
    return ["config.json", *write_texts(folder, {"summary.json": json.dumps(figures, indent=2) + "\n", "summary.txt": text})]


def write_config(folder: Path, experiment: Experiment) -> None:
    """Write the config, by which an unfinished run is known."""
    write_text(folder / "config.json", json.dumps(to_config(experiment), indent=2) + "\n")


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
