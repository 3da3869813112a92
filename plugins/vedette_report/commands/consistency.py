"""`vedette consistency`: whether a tracker's covariances fit a recording, or another program's estimates its truth."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeAlias

from vedette import ConfigError, Experiment
from vedette.commands import DONE, options
from vedette.config import load, to_config, warnings_of
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder, locked, write_texts
from vedette_report.detector_errors.between_axes import together
from vedette_report.detector_errors.in_tracks import NIS_IS_NOT_ENOUGH, in_tracks
from vedette_report.drawing.brought import Drawing, drawing
from vedette_report.progress import on_terminal
from vedette_report.recorded import Recorded, beside_truth, of_table, pooled, recorded, sentences, table
from vedette_report.warnings.late import late
from vedette_report.warnings.turned import turned
from vedette_report.warnings.words import held, left_out

Told: TypeAlias = tuple[str, Sequence[Recorded], str, dict[str, object]]
"""A title, what is told of each track, the text, and the figures as plain data."""


def run(arguments: Namespace) -> int:
    """Run the tracker, or read what another one made; print what each track says of itself, and write it if asked to."""
    path = Path(arguments.config)
    if path.suffix.lower() == ".csv":
        if changed := options.overrides(arguments):
            raise ConfigError.at("--set", f"changes a config, and {path} holds estimates: {changed[0]!r} has no place there")
        return _tell(arguments, Inputs.of(path, arguments.style), lambda: _of_table(path))
    config = path / "config.json" if (path / "config.json").is_file() else path
    experiment = load(config, overrides=options.overrides(arguments))
    return _tell(arguments, Inputs.of(config, arguments.style, to_config(experiment)), lambda: _of_run(experiment))


def _tell(arguments: Namespace, reads: Inputs, judged: Callable[[], Told]) -> int:
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    pictures = drawing(arguments.format, arguments.columns, arguments.style)
    with locked(folder, reads, ("consistency.txt", "consistency.json")):
        title, told, text, figures = judged()
        written = [] if folder is None else _write(folder, title, told, text, figures, pictures)
        print(text)  # once all is written: the reader may have gone
        if written:
            print(f"{folder}: {', '.join(written)}")
        if arguments.json:
            print(json.dumps(figures))
        return DONE


def _of_table(path: Path) -> Told:
    told = of_table(path)
    said = sentences(told)
    figures: dict[str, object] = {"title": path.stem, "tracks": [one.data() for one in told], "told": said}
    return path.stem, told, "\n".join([*table(told), *said]), figures


def _of_run(experiment: Experiment) -> Told:
    tracker = experiment.tracker
    with on_terminal() as progress:
        result = experiment.run(progress=progress, keep_states=True)
    errors = in_tracks(tracker, result.scans, result.states)
    told = recorded(experiment, result, errors)
    objects = pooled(told, tracker.gate.probability)
    around = list(turned(tracker, result.scans, result.recording.truth))
    apart = [one.sensor for one in around]
    off = list(beside_truth(tracker, told, apart))
    joined = list(together(tracker, result.scans, result.tracks))
    odd = [
        *warnings_of(result.intake, result.recording, tracker.sensors),
        *left_out(result.intake, result.recording),
        *held(tracker),
        *map(str, around),
        *map(str, off),
        *map(str, joined),
        *late(tracker, result.scans, result.tracks, [*apart, *(one.sensor for one in off)]),
    ]
    said = sentences(told)
    lines = [*table(told), *said, *(one.text for one in objects if one.text)]
    lines += [f"{NIS_IS_NOT_ENOUGH}:", *(f"  {line}" for one in errors for line in one.text.splitlines())] if errors else []
    figures: dict[str, object] = {
        "title": experiment.title,
        "seed": experiment.seed,
        "tracks": [one.data() for one in told],
        "objects": [one.data() for one in objects],
        "errors": [one.data() for one in errors],
        "warnings": odd,
        "turned": [one.data() for one in around],
        "beside_truth": [one.data() for one in off],
        "between_axes": [one.data() for one in joined],
        "told": said,
    }
    return experiment.title, told, "\n".join([*(f"LOOKS WRONG: {one}" for one in odd), *lines]), figures


def _write(
    folder: Path, title: str, told: Sequence[Recorded], text: str, figures: dict[str, object], pictures: Drawing
) -> list[str]:
    folder.mkdir(parents=True, exist_ok=True)
    texts = {"consistency.txt": text + "\n", "consistency.json": json.dumps(figures, indent=2) + "\n"}
    written = write_texts(folder, texts)
    if pictures.possible():
        written.append(pictures.look.file("consistency"))
        titled = f"Consistency: {title}" if title else "Consistency"
        pictures.save("consistency_recorded", (titled, told), folder / written[-1])
    return written
