"""`vedette consistency`: whether a tracker's covariances fit a recording, with truth or without."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from vedette.commands import DONE, options
from vedette.config import load, to_config, warnings_of
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder, locked, write_texts
from vedette_report.detector_errors.between_axes import together
from vedette_report.detector_errors.in_tracks import NIS_IS_NOT_ENOUGH, in_tracks
from vedette_report.drawing.brought import Drawing, drawing
from vedette_report.progress import on_terminal
from vedette_report.recorded import Recorded, beside_truth, pooled, recorded, sentences, table
from vedette_report.warnings.late import late
from vedette_report.warnings.turned import turned
from vedette_report.warnings.words import held, left_out


def run(arguments: Namespace) -> int:
    """Run the tracker, print what each track says of itself, and write text, figures and picture if asked to."""
    of_run = Path(arguments.config) / "config.json"
    config = of_run if of_run.is_file() else Path(arguments.config)
    experiment = load(config, overrides=options.overrides(arguments))
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    pictures = drawing(arguments.format, arguments.columns, arguments.style)
    reads = Inputs.of(config, arguments.style, to_config(experiment))
    with locked(folder, reads, ("consistency.txt", "consistency.json")):
        with on_terminal() as progress:
            result = experiment.run(progress=progress, keep_states=True)
        errors = in_tracks(experiment.tracker, result.scans, result.states)
        told = recorded(experiment, result, errors)
        objects = pooled(told, experiment.tracker.gate.probability)
        tracker = experiment.tracker
        around = list(turned(tracker, result.scans, result.recording.truth))
        apart = [one.sensor for one in around]
        off = list(beside_truth(tracker, result.scans, result.tracks, told, result.recording.truth, apart))
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
        lines += (
            [f"{NIS_IS_NOT_ENOUGH}:", *(f"  {line}" for one in errors for line in one.text.splitlines())] if errors else []
        )
        text = "\n".join([*(f"LOOKS WRONG: {one}" for one in odd), *lines])
        figures = {
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
        written = [] if folder is None else _write(folder, experiment.title, told, text, figures, pictures)
        print(text)  # once all is written: the reader may have gone
        if written:
            print(f"{folder}: {', '.join(written)}")
        if arguments.json:
            print(json.dumps(figures))
        return DONE


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
