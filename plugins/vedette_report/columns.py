"""Text in columns: tables, names with their texts, numbers that may be missing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from textwrap import wrap

_TEXT, _WIDE = 21, 118
"""Columns at which texts begin and end, in characters."""


def aligned(table: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the rows of a table with its columns under one another: the first to the left, the others to the right."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    for first, *rest in table:
        yield "  ".join([first.ljust(widths[0]), *map(str.rjust, rest, widths[1:])])


def rows(pairs: Iterable[tuple[str, str]]) -> list[str]:
    """Return a name and its text in a line each, or in more where the text is long."""
    lines = []
    for name, text in pairs:
        lines += wrap(text, _WIDE, initial_indent=f"  {name:<{_TEXT - 2}}", subsequent_indent=" " * _TEXT)
    return lines


def percent(part: float | None) -> str:
    """Return a part of 1 in percent, or "-"."""
    return "-" if part is None else f"{100 * part:.3g} %"


def maybe(value: float | None, unit: str = "") -> str:
    """Return a value with its unit, or "-"."""
    return "-" if value is None else f"{value:.3g} {unit}".rstrip()
