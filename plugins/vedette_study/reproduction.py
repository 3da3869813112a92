"""A study's result for people and for programs: text and JSON."""

from __future__ import annotations

from collections.abc import Iterator
from textwrap import wrap
from typing import Any

import attrs
import numpy as np

from vedette.reproduction import Cell, Claim, Condition, Findings, Table
from vedette_report.columns import aligned

_WIDTH = 118


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
        lines += wrap(claim.why, _WIDTH, initial_indent="  ", subsequent_indent="  ")
    return "\n".join(lines)


def told(condition: Condition, runs: int) -> str:
    """Return a condition's figure, its bounds, and whether it holds."""
    bounds = [f"{word} {bound:g}" for word, bound in (("at least", condition.least), ("at most", condition.most))]
    asked = " and ".join(words for words in bounds if "inf" not in words)
    held = {True: "holds", False: "fails", None: "open"}[condition.holds(runs)]
    value = "no figure" if condition.figure.measured is None else _measured(condition.figure)
    printed = "" if condition.figure.published is None else f" (published {condition.figure.published:g})"
    return f"{condition.what}: {value}{printed}, to be {asked}: {held}"


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
