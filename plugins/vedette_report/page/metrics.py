"""The figures of runs as tables, side by side: of each what it is, its unit, and its value in each run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vedette.config import installed_figures
from vedette.metrics import FIGURES, OF_OBJECTS, Figure

_BEGUN = Figure("begun", "1", "tracks begun")
_LEFT_OUT = ("seed", "scans_taken", "returns", "refused")
"""Numbers of a summary that are no figures of its tracks."""


def meanings() -> dict[str, Figure]:
    """Return what the figures of `summary.json` are, by name, plugins' too; docs/metrics.md defines Vedette's."""
    return {of.name: of for of in (_BEGUN, *FIGURES, *installed_figures())}


def metrics(figures: Sequence[Mapping[str, Any]], modes: Sequence[str], axes: Sequence[str], unit: str) -> dict[str, Any]:
    """Return `rows` of the figures, and `objects` of each true object, one value a run in each.

    Of several runs it returns the figures that two of them have.
    `modes` names the modes, `axes` those of the map, `unit` is that of positions.
    """
    known = meanings()
    names = [*known, *(name for each in figures for name in each if name not in known and name not in _LEFT_OUT)]
    least = min(2, len(figures))
    rows = [row for name in dict.fromkeys(names) for row in _rows(name, figures, modes, axes, unit) if _known(row) >= least]
    objects = [_objects(run.get("truths")) for run in figures]
    told = []
    for true in dict.fromkeys(name for run in objects for name in run if sum(name in each for each in objects) >= least):
        cells = {of.name: [_number(run.get(true, {}).get(of.name)) for run in objects] for of in OF_OBJECTS}
        told.append({"name": true, **cells})
    heads = {of.name: [of.about, _unit(of.unit, unit)] for of in OF_OBJECTS}
    return {"rows": rows, "objects": told, "of_objects": heads}


def _rows(
    name: str, figures: Sequence[Mapping[str, Any]], modes: Sequence[str], axes: Sequence[str], unit: str
) -> list[dict[str, Any]]:
    values = [run.get(name) for run in figures]
    figure = meanings().get(name)
    about, of = (name.replace("_", " "), "") if figure is None else (figure.about, figure.unit)
    if any(isinstance(value, list) and all(_number(part) is not None for part in value) and value for value in values):
        longest = max(len(value) for value in values if isinstance(value, list))
        parts = {"mode_prob": modes, "bias_m": axes}.get(name, ())
        told = [parts[i] if i < len(parts) else str(i + 1) for i in range(longest)]
        columns = [[_part(value, i) for value in values] for i in range(longest)]
        return [
            {"name": f"{name}.{i}", "about": f"{about}, {told[i]}", "unit": _unit(of, unit), "values": column}
            for i, column in enumerate(columns)
        ]
    numbers = [_number(value) for value in values]
    if all(value is None for value in numbers):
        return []
    return [{"name": name, "about": about, "unit": _unit(of, unit), "values": numbers}]


def _objects(told: Any) -> dict[str, Mapping[str, Any]]:
    """Return the true objects of a summary by name; what is none, in a file that somebody altered, is left out."""
    entries = [one for one in told if isinstance(one, dict)] if isinstance(told, list) else []
    return {one["name"]: one for one in entries if isinstance(one.get("name"), str)}


def _known(row: dict[str, Any]) -> int:
    return sum(value is not None for value in row["values"])


def _unit(of: str, unit: str) -> str:
    """Return a unit as it is shown: none of a pure number, lengths in px where positions are."""
    if of == "1":
        return ""
    return of.replace("m", unit, 1) if of.startswith("m") else of


def _part(value: Any, i: int) -> float | None:
    return _number(value[i]) if isinstance(value, list) and i < len(value) else None


def _number(value: Any) -> float | None:
    return value if isinstance(value, int | float) and not isinstance(value, bool) else None
