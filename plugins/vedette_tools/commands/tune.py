"""`vedette tune`: parameters from detections, with errors, judged on scans held back."""

from __future__ import annotations

import json
from argparse import Namespace
from pathlib import Path

from vedette.commands import DONE, options
from vedette.config import read_file
from vedette.errors import ConfigError
from vedette_files.files_read import Inputs
from vedette_files.writing import check_folder, locked, write_texts
from vedette_report.drawing.brought import drawing
from vedette_report.drawing.canvas import Look
from vedette_report.output import can_draw
from vedette_study.grid import short_names
from vedette_tools.tuning import by_place_text
from vedette_tools.tuning.by_place import COLUMNS, ROWS, tune_detection
from vedette_tools.tuning.config_text import toml
from vedette_tools.tuning.picture import Growth, Hill, draw
from vedette_tools.tuning.summary import data, summary, text
from vedette_tools.tuning.tuner import Found, Tuned, tune


def run(arguments: Namespace) -> int:
    """Tune, print the table, write the tuned config, the figures and the picture."""
    folder = Path(arguments.out) if arguments.out else Path("out") / f"{Path(arguments.config).stem}-tuned"
    check_folder(folder)
    look = drawing(arguments.format, arguments.columns, arguments.style).look
    changed = [text.partition("=")[2].strip("'\"") for text in options.overrides(arguments)]
    reads = Inputs.of(arguments.config, arguments.style, read_file(arguments.config), changed)
    with locked(folder, reads, ("tuned.toml", "tuned.txt", "tuned.json")):
        if arguments.detection:
            return _by_place(arguments, folder)
        written = list[str]()
        tuned = tune(
            arguments.config,
            arguments.free,
            overrides=options.overrides(arguments),
            by=arguments.by,
            part=_number("--part", arguments.part),
            starts=options.whole("--starts", arguments.starts, 1),
            method=arguments.method,
            workers=options.whole("--workers", arguments.workers, 1),
            out=folder,
            resume=arguments.resume,
            write=lambda tuned: written.extend(_write(folder, tuned, look)),
        )
        print(text(tuned))  # once all is written: the reader may have gone
        print(f"{folder}: {', '.join(written)}")
        if arguments.json:
            print(json.dumps(data(tuned)))
        return DONE


def _by_place(arguments: Namespace, folder: Path) -> int:
    """Find a detection probability by place; print the table, write the config and the figures."""
    for option, default in (("free", []), ("resume", False)):
        if getattr(arguments, option) != default:
            raise ConfigError.at(f"--{option}", "does not go with --detection: tune what is free before or after it")
    path, _, cells = (each.strip() for each in arguments.detection.partition("="))
    rows, cross, columns = cells.partition("x") if cells else (str(ROWS), "x", str(COLUMNS))
    if not cross:
        raise ConfigError.at("--detection", f"must be written as {path}=4x8, rows by columns, got {cells!r}")
    by_place = tune_detection(
        arguments.config,
        path,
        rows=options.whole("--detection", rows, 1),
        columns=options.whole("--detection", columns, 1),
        part=_number("--part", arguments.part),
        overrides=options.overrides(arguments),
    )
    texts = {
        "tuned.toml": by_place_text.toml(by_place),
        "tuned.txt": by_place_text.text(by_place) + "\n",
        "tuned.json": json.dumps(by_place_text.data(by_place), indent=2) + "\n",
    }
    written = write_texts(folder, texts)
    print(by_place_text.text(by_place))
    print(f"{folder}: {', '.join(written)}")
    if arguments.json:
        print(json.dumps(by_place_text.data(by_place)))
    return DONE


def _write(folder: Path, tuned: Tuned, look: Look) -> list[str]:
    texts = {
        "tuned.toml": toml(tuned),
        "tuned.txt": text(tuned) + "\n",
        "tuned.json": json.dumps(data(tuned), indent=2) + "\n",
    }
    written = write_texts(folder, texts)
    if can_draw():
        judged, names = tuned.judged, short_names(each.free.path for each in tuned.parameters)
        growth = None
        if judged.before is not None:
            growth = Growth(judged.times, judged.after - judged.before, judged.tuned)
        what = "log-likelihood" if tuned.by == "likelihood" else "consistency"
        facts = (
            f"{what} below its top along each parameter, the others following; band: one standard error, whose parabola is "
            "dotted; dashed: before"
        )
        hills = [_hill(each, names[each.free.path]) for each in tuned.parameters]
        written.append(look.file("tuned"))
        draw(f"Tuned: {tuned.title}" if tuned.title else "Tuned", facts, hills, growth, folder / written[-1], look)
    return written


def _hill(one: Found, name: str) -> Hill:
    curve, band = one.curve, None
    assert curve is not None
    if one.error is not None:
        band = (one.after - one.error, one.after + one.error)
    return Hill(
        name, one.free.place.unit, curve.values, curve.heights, curve.parabola, one.before, one.after, band,
        one.free.scale == "log" and float(max(curve.values) / min(curve.values)) > 5.0, summary(one),
    )  # fmt: skip


def _number(option: str, given: str) -> float:
    """Return a number; ConfigError if it is none."""
    try:
        return float(given)
    except ValueError:
        raise ConfigError.at(option, f"must be a number, got {given!r}") from None
