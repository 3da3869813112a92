"""A study of many runs for people and for programs: its tables, its pictures, its files."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve

from vedette.space import Array
from vedette_files.writing import whole_file, write_texts
from vedette_report.findings import Cell, Chart, Curve, Panel, Table
from vedette_study.chunk import study_figures
from vedette_study.grid import short_names, spaced_evenly_in_log, told, unit_at
from vedette_study.outcome import Outcome, numeric_axes
from vedette_study.redraw import Redraw
from vedette_study.reproduction import rows
from vedette_study.statistics import Mean

MOST_CURVES = 8
"""More points than this are too many for one panel."""
_SERIES = ("position_rmse", "nees", "nis")
"""The figures that are drawn against time."""
_SWEPT = (*_SERIES, "lost")
"""Those that are drawn along a swept axis."""

_NIS_ALONE = (
    "nis tells whether covariances fit the returns, not which point is better: that takes a truth, or, of numbers in a "
    "config, their likelihood, which vedette tune compares"
)


def text(outcome: Outcome) -> str:
    """Return means with their standard errors, and the differences to the first point."""
    plan = outcome.plan
    head = f"{outcome.runs:,} runs at {len(plan.points):,} points, seed {plan.seed}; +- is one Monte-Carlo standard error"
    if outcome.interrupted:
        head += f"; interrupted, {plan.runs:,} were asked for"
    elif outcome.runs < plan.runs:
        head += "; precise enough, so it stopped early"
    lines = [plan.title, head] if plan.title else [head]
    if plan.redraw is not None:
        lines.append(_drawn(plan.redraw))
    for table in tables(outcome):
        nothing = "no figure exists: no run confirmed a track, or compared one with a truth"
        lines += ["", table.title, *(rows(table) if table.columns else [nothing])]
    if len(plan.points) > 1 and _seen(outcome) == ["nis"]:
        lines += ["", _NIS_ALONE]
    if np.any(outcome.figures.get("approximated", 0) > 0):
        why = "how often in a run a track's association weights were not exact: its cluster was too large"
        lines += ["", f"approximated: {why}"]
    return "\n".join(lines)


def _drawn(redraw: Redraw) -> str:
    """Return what the runs over a recording draw."""
    parts = [f"leaves out {100 * redraw.drop:g} % of the recording's returns"] if redraw.drop else []
    parts += ["starts given tracks from their prior"] if redraw.starts else []
    return f"each run {' and '.join(parts) or 'takes the recording as it is'}, drawn anew; all points meet the same draws"


def tables(outcome: Outcome) -> Iterator[Table]:
    """Yield the means, with several points the paired differences, and the means at each place that was averaged over."""
    points = outcome.plan.points
    known = study_figures()
    names = _seen(outcome)
    columns = tuple(name if known[name].unit == "1" else f"{name} [{known[name].unit}]" for name in names)
    over = f", each the mean over {', '.join(outcome.plan.average)}" if outcome.parts is not None else ""
    means = tuple((at.name, _cells(outcome.means(i), names)) for i, at in enumerate(points))
    yield Table(f"Means over runs{over}", columns, means)
    if len(points) > 1:
        paired = tuple((at.name, _cells(outcome.differences(i), names)) for i, at in enumerate(points) if i)
        yield Table(f"Differences to {points[0].name}, paired run by run", columns, paired)
    if outcome.parts is not None:
        each = outcome.parts.plan.points
        means = tuple((at.name, _cells(outcome.parts.means(i), names)) for i, at in enumerate(each))
        yield Table("Each by itself", columns, means)


def _seen(outcome: Outcome) -> list[str]:
    """Return the figures that the text has."""
    known = study_figures()
    return [name for name, values in outcome.figures.items() if not known[name].detail and _says_something(name, values)]


def _says_something(name: str, values: Array) -> bool:
    """Return whether there is a figure at all; of one that is 0 where all is well, whether something is not."""
    return bool(np.any(values > 0) if name == "approximated" else np.any(np.isfinite(values)))


def _cells(means: Mapping[str, Mean], names: Sequence[str]) -> tuple[Cell, ...]:
    return tuple(Cell(means[name].value, means[name].error) for name in names)


def write_study(folder: Path, outcome: Outcome) -> list[str]:
    """Write text, JSON and CSV; return their names."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = {"summary.txt": text(outcome) + "\n", "summary.json": json.dumps(outcome.data(), indent=2) + "\n"}
    names = write_texts(folder, texts)
    with whole_file(folder / "summary.csv") as file:
        table = [_flat(row) for row in outcome.table()]
        writer = csv.DictWriter(file, list(table[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(table)
    return [*names, "summary.csv"]


def _flat(row: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in row.items():
        if name in study_figures():
            flat |= {name: value["value"], f"{name}_error": value["error"]}
        else:
            flat[name] = told(value)
    return flat


def charts(outcome: Outcome) -> Iterator[Chart]:
    """Yield errors against time, and the figures along each swept axis of numbers, or else of the points beside one another.

    Bands and bars are two standard errors.
    """
    points = outcome.plan.points
    title = outcome.plan.title or "Study"
    shown = range(min(len(points), MOST_CURVES))
    if all(len(outcome.against[i].times) for i in shown):
        panels: list[Panel] = []
        for name in _SERIES:
            curves = []
            for i in shown:
                series = outcome.against[i]
                curves.append(Curve(points[i].name, series.times, series.values[name], doubt=2 * series.errors[name]))
            panels.append(_panel(outcome, name, "time [s]", curves, first=not panels))
        yield Chart("time", f"Errors against time: {title}", tuple(panels))
    swept = tuple(numeric_axes(outcome.plan))
    if len(points) > 1 and not swept:
        yield Chart("points", f"Figures by tracker: {title}", _beside(outcome))
    for path in swept:
        name, log = short_names(outcome.plan.axes)[path], spaced_evenly_in_log(outcome.plan.axes[path])
        unit = unit_at(points[0].experiment, path)
        across = f"{path} [{unit}]" if unit else path
        panels = []
        for figure in _SWEPT:
            if figure in outcome.figures:
                panels.append(_panel(outcome, figure, across, _along(outcome, path, figure), first=not panels, log=log))
        if panels:
            yield Chart(f"sweep_{name}", f"Figures along {name}: {title}", tuple(panels))
        if "coverage" in outcome.figures and "false_tracks" in outcome.figures:
            what = f"Coverage against false tracks, along {name}: {title}"
            yield Chart(f"coverage_{name}", what, (_operating(outcome, path, name),))


def _beside(outcome: Outcome) -> tuple[Panel, ...]:
    """Return each figure at the first points, as trackers that differ by name."""
    shown, panels = outcome.plan.points[:MOST_CURVES], list[Panel]()
    ticks = tuple(", ".join(map(told, at.labels.values())) for at in shown)
    across = ", ".join(short_names(outcome.plan.axes).values())
    for name, figure in study_figures().items():
        if not figure.label:
            continue
        y, error = np.array([_numbers(outcome, i, name) for i in range(len(shown))]).T
        if not np.any(np.isfinite(y)):
            continue
        curves = [Curve("", np.arange(len(y), dtype=float), y, "points", 0, doubt=2 * np.nan_to_num(error))]
        title = "" if panels else f"{outcome.runs:,} runs; bars: two standard errors"
        if figure.expected is not None:
            title = "1 is expected"
            curves.append(_expected(-0.5, len(y) - 0.5))
        panels.append(Panel(title, across, figure.label, tuple(curves), ticks=ticks, within=figure.within))
    return tuple(panels)


def _panel(outcome: Outcome, name: str, across: str, curves: Sequence[Curve], *, first: bool, log: bool = False) -> Panel:
    """Draw one figure. The first panel states what holds for all: which curve is which, and what the bands are."""
    title = f"{outcome.runs:,} runs; bands: two standard errors" if first else ""
    drawn = [curve if first else evolve(curve, label="") for curve in curves]
    figure = study_figures()[name]
    if figure.expected is not None:
        title = "1 is expected"
        drawn.append(_expected(float(curves[0].x.min()), float(curves[0].x.max())))
    return Panel(title, across, figure.label, tuple(drawn), within=figure.within, log_across=log)


def _operating(outcome: Outcome, path: str, name: str) -> Panel:
    """Draw coverage against false tracks along a swept axis, with the config's own value marked."""
    own, curves, marked = outcome.plan.own.get(path), list[Curve](), list[Curve]()
    lines = zip(_along(outcome, path, "false_tracks"), _along(outcome, path, "coverage"), strict=True)
    for i, (false, covered) in enumerate(lines):
        notes = tuple(f"{value:g}" for value in covered.x)
        curves.append(
            Curve(covered.label, false.y, covered.y, "marked", i, doubt=covered.doubt, doubt_across=false.doubt, notes=notes)
        )
        here = covered.x == own if isinstance(own, int | float) else np.zeros(len(covered.x), dtype=bool)
        if np.any(here):
            label = f"as configured: {name} {own:g}" if not marked else ""
            marked.append(Curve(label, false.y[here], covered.y[here], "rings", i))
    told = "" if marked else f"; the configured {name} is not among the values"
    title = f"{outcome.runs:,} runs; bars: two standard errors; numbers: {name}{told}"
    return Panel(title, "false tracks at a time", "share of the objects' time that is covered", (*curves, *marked))


def _along(outcome: Outcome, path: str, name: str) -> list[Curve]:
    """Return a curve along one axis for each choice of all the others."""
    names = short_names(outcome.plan.axes)
    lines: dict[str, list[tuple[float, float, float]]] = {}
    for i, at in enumerate(outcome.plan.points):
        rest = ", ".join(f"{names[other]} {told(value)}" for other, value in at.labels.items() if other != path)
        lines.setdefault(rest, []).append((float(at.labels[path]), *_numbers(outcome, i, name)))
    curves = []
    for label, line in list(lines.items())[:MOST_CURVES]:
        x, y, error = np.array(sorted(line)).T
        curves.append(Curve(label, x, y, "marked", doubt=2 * error))
    return curves


def _numbers(outcome: Outcome, i: int, name: str) -> tuple[float, float]:
    """Return the mean of a figure at a point, and its error; NaN where there is none."""
    mean = outcome.means(i).get(name, Mean(None, None, 0))
    return np.nan if mean.value is None else mean.value, np.nan if mean.error is None else mean.error


def _expected(begin: float, end: float) -> Curve:
    return Curve("", np.array([begin, end]), np.ones(2), "expected")
