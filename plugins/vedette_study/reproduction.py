"""A study's result for people and for programs: text and JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Any

import attrs
import numpy as np

from vedette_report.columns import aligned
from vedette_report.findings import Cell, Claim, Condition, Findings, Place, Table

_WIDTH = 118
_MARKS = {"reproduced": "holds", "not reproduced": "fails", "not decided": "open", "remark": "-"}


def text(result: Findings) -> str:
    """Return tables and verdicts, published figures beside measured ones."""
    lines = [result.title, f"{result.runs:,} runs, seed {result.seed}; +- is one Monte-Carlo standard error"]
    for table in (*result.tables, *result.machine):
        lines += ["", table.title, *wrap(table.note, _WIDTH), *rows(table)]
    lines += ["", "What the paper claims"]
    for claim in result.claims:
        lines += wrap(f"{claim.headline}: {claim.text}", _WIDTH, initial_indent="* ", subsequent_indent="  ")
        for condition in claim.conditions:
            lines += wrap(told(condition, claim.runs), _WIDTH, initial_indent="  - ", subsequent_indent="    ")
        lines += _map(claim.places)
        lines += wrap(claim.why, _WIDTH, initial_indent="  ", subsequent_indent="  ")
    return "\n".join(lines)


def told(condition: Condition, runs: int) -> str:
    """Return a condition's figure, its bounds, and whether it holds."""
    low, high = ("more than", "less than") if condition.strict else ("at least", "at most")
    bounds = [f"{word} {bound:g}" for word, bound in ((low, condition.least), (high, condition.most))]
    asked = " and ".join(words for words in bounds if "inf" not in words)
    held = {True: "holds", False: "fails", None: "open"}[condition.holds(runs)]
    value = "no figure" if condition.figure.measured is None else _measured(condition.figure)
    cell = condition.figure
    beside = [] if cell.published is None else [f"published {cell.published:g}"]
    beside += [] if cell.trimmed is None else [f"trimmed {_measured(Cell(*cell.trimmed))}"]
    printed = f" ({', '.join(beside)})" if beside else ""
    return f"{condition.what}: {value}{printed}, to be {asked}: {held}"


def _map(places: Sequence[Place]) -> Iterator[str]:
    """Yield where a claim holds: the last of the unsaid across, all others down."""
    if not places:
        return
    *down, across = places[0].values
    columns = list(dict.fromkeys(place.values[across] for place in places))
    verdicts = {tuple(place.values.values()): place.verdict for place in places}
    rows = dict.fromkeys(tuple(place.values[name] for name in down) for place in places)
    marks = [(", ".join(row), "", *(_MARKS.get(verdicts.get((*row, column), ""), "") for column in columns)) for row in rows]
    yield from (f"    {line}" for line in aligned([(", ".join(down), across, *columns), *marks]))


def rows(table: Table) -> Iterator[str]:
    """Yield the table, right-aligned: one line for each row, and one more under it where the paper printed figures."""
    lines: list[tuple[str, ...]] = [("", *table.columns)]
    for label, cells in table.rows:
        lines.append((label, *map(_measured, cells)))
        if any(cell.published is not None for cell in cells):
            lines.append(("  published", *("" if cell.published is None else f"{cell.published:g}" for cell in cells)))
    yield from aligned(lines)


def _measured(cell: Cell) -> str:
    if cell.measured is None:
        return "-"
    if cell.error is None or cell.error == 0:
        return f"{cell.measured:.4g}"
    places = int(np.clip(1 - np.floor(np.log10(cell.error)), 0, 6))
    return f"{cell.measured:.{places}f} +- {cell.error:.{places}f}"


def data(result: Findings) -> dict[str, Any]:
    """Return all but the figures as plain data."""
    return {
        "title": result.title,
        "runs": result.runs,
        "seed": result.seed,
        "tables": [
            {
                "title": table.title,
                "note": table.note,
                "rows": {
                    label: dict(zip(table.columns, map(attrs.asdict, cells), strict=True)) for label, cells in table.rows
                },
            }
            for table in (*result.tables, *result.machine)
        ],
        "claims": [_claim(claim) for claim in result.claims],
    }


def _claim(claim: Claim) -> dict[str, Any]:
    """Return a claim as plain data; a bound that a condition does not have is None, as JSON knows no infinity."""
    plain = attrs.asdict(claim)
    for condition, filled in zip(claim.conditions, plain["conditions"], strict=True):
        filled |= {name: bound if np.isfinite(bound := getattr(condition, name)) else None for name in ("least", "most")}
        filled["holds"] = condition.holds(claim.runs)
    return plain
