"""`vedette consistency`: whether a tracker's covariances fit a recording, with truth or without."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from vedette.commands import asked
from vedette.commands.ending import DONE
from vedette.commands.output import can_draw, look_of
from vedette.config import load
from vedette.experiment import Experiment
from vedette.io.atomic import whole_file
from vedette.progress import on_terminal
from vedette.report.canvas import Look
from vedette.report.consistency_recorded import Lines, draw
from vedette.report.files import check_folder
from vedette.report.warnings import of_input
from vedette.testing.pooled import pooled
from vedette.testing.recorded import Recorded, recorded


def run(arguments: Namespace) -> int:
    """Run the tracker, print what each track says of itself, and write text, figures and picture if asked to."""
    experiment = load(arguments.config, overrides=asked.overrides(arguments))
    folder = None if arguments.out is None else Path(arguments.out)
    if folder is not None:
        check_folder(folder)
    look = look_of(arguments)
    with on_terminal() as progress:
        result = experiment.run(progress=progress, keep_states=True)
    told = recorded(experiment, result)
    objects = pooled(told, experiment.tracker.gate.probability)
    odd = [f"LOOKS WRONG: {said}" for said in of_input(result.intake, result.recording, experiment.tracker.sensors)]
    text = "\n".join([*odd, *(one.text for one in told), *(one.text for one in objects if one.text)])
    found = {
        "title": experiment.title,
        "seed": experiment.seed,
        "tracks": [one.data() for one in told],
        "objects": [one.data() for one in objects],
    }
    print(text)
    if folder is not None:
        print(f"{folder}: {', '.join(_write(folder, experiment, told, text, found, look))}")
    if arguments.json:
        print(json.dumps(found))
    return DONE


def _write(
    folder: Path, experiment: Experiment, told: Sequence[Recorded], text: str, found: dict[str, object], look: Look
) -> list[str]:
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, content in (("consistency.txt", text), ("consistency.json", json.dumps(found, indent=2))):
        with whole_file(folder / name) as file:
            file.write(content + "\n")
        written.append(name)
    if can_draw():
        title = f"Consistency: {experiment.title}" if experiment.title else "Consistency"
        written.append(look.file("consistency"))
        draw(title, [_lines(one) for one in told], told[0].axes, told[0].measured, folder / written[-1], look)
    return written


def _lines(one: Recorded) -> Lines:
    seen = one.innovations
    hit = seen.hit > 0.5
    name = f"track {one.track}" if one.truth is None else f"{one.truth}, track {one.track}"
    nis = seen.nis[hit] / (seen.hit * seen.axes)[hit]
    return Lines(name, one.times, one.nees, seen.times[hit], nis, seen.correlation, seen.pairs)
