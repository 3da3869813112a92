"""Columns that a table holds in other shape: a time in several columns, a position in the cells of one."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from datetime import datetime, timedelta

from vedette_files.tables.numbers import is_number

PLUS = " + "
"""Between the titles of columns whose cells are read as one, with a blank between them."""

MIDDLE = " .. "
"""Between the titles of two columns of which the middle is read, as of two corners of a box."""

PARTS = ("x", "y", "z")
"""How titles of a position's coordinates end, after the title of its column and a point."""

FRACTIONS = {
    **dict.fromkeys(("nsec", "nsecs", "nanosec", "nanosecs", "nanoseconds", "nanos", "ns"), 9),
    **dict.fromkeys(("usec", "usecs", "microseconds", "micros", "us"), 6),
    **dict.fromkeys(("msec", "msecs", "milliseconds", "millis", "ms"), 3),
}
"""Last words of titles that count parts of a second beside whole ones, and how many digits these have."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
_POINT = re.compile(
    rf"(?:SRID=\d+;\s*)?POINT\s*[ZM]{{0,2}}\s*\(\s*({_NUMBER})\s+({_NUMBER})(?:\s+({_NUMBER}))?[^)]*\)", re.IGNORECASE
)
_TUPLE = re.compile(rf"[\[(]?\s*({_NUMBER})\s*[,;]\s*({_NUMBER})(?:\s*[,;]\s*({_NUMBER}))?\s*[\])]?")

MJD = datetime(1858, 11, 17)
"""The day from which modified Julian dates count."""

_MJD, _OF_DAY = re.compile(r"[2-7]\d{4}"), re.compile(r"(0|[1-9]\d{0,4})(\.\d*)?")
"""Such a day of 1913 to 2077, and seconds of it."""

_CLOCK = re.compile(r"\d{1,2}:\d\d:\d\d")

Cell = Callable[[Sequence[str]], str]


def coordinates(cell: str) -> tuple[str, ...]:
    """Return the coordinates in a cell, as POINT(10.5 59.4) of WKT or (59.4, 10.5); () if it holds no position.

    >>> coordinates("POINT Z (10.5 59.4 3)"), coordinates("[59.4, 10.5]")
    (('10.5', '59.4', '3'), ('59.4', '10.5'))
    """
    found = _POINT.fullmatch(cell.strip()) or _TUPLE.fullmatch(cell.strip())
    return tuple(part for part in found.groups() if part is not None) if found else ()


def made_of(title: str, header: Sequence[str]) -> tuple[str, ...]:
    """Return the columns of a table that a title is read from: itself, or those it is made of; () if there are none."""
    if title in header:
        return (title,)
    parts = tuple(title.split(PLUS))
    ends = tuple(title.split(MIDDLE))
    for several in (parts, ends if len(ends) == 2 else ()):
        if len(several) > 1 and all(part in header for part in several):
            return several
    stem, _, part = title.rpartition(".")
    return (stem,) if part in PARTS and stem in header else ()


def perhaps_of(title: str) -> tuple[str, ...]:
    """Return the columns that a title may be read from, whatever the table holds."""
    stem, _, part = title.rpartition(".")
    return (
        title,
        *(part for mark in (PLUS, MIDDLE) if mark in title for part in title.split(mark)),
        *((stem,) if part in PARTS else ()),
    )


def cell_of(title: str, header: Sequence[str]) -> Cell:
    """Return how a title's cell is read from a row under a header that holds what it is made of."""
    parts = made_of(title, header)
    where = [header.index(part) for part in parts]
    if parts == (title,):
        return lambda cells: cells[where[0]]
    if len(parts) == 1:
        axis = PARTS.index(title[-1])
        return lambda cells: _coordinate(cells[where[0]], axis)
    if title == MIDDLE.join(parts):
        return lambda cells: middle(*(cells[i] for i in where))
    digits = digits_of(parts[-1]) if len(parts) < 4 else 0
    return lambda cells: joined([cells[i] for i in where], digits)


def middle(first: str, second: str) -> str:
    """Return the number between two; a cell that is none as it is, so that it is told.

    >>> middle("1.5", "4"), middle("1", "")
    ('2.75', '')
    """
    for cell in (first, second):
        if not is_number(cell):
            return cell
    return repr(0.5 * (float(first) + float(second)))


def digits_of(title: str) -> int:
    """Return how many digits the parts of a second have that a title counts; 0 if it counts none."""
    return FRACTIONS.get(re.split(r"[^a-z]+", title.lower())[-1], 0)


def joined(cells: Sequence[str], digits: int = 0) -> str:
    """Return cells as one: with a blank between them, or a whole number, or a time of day, and its fraction of so many
    `digits`.

    A day as data frames write it, at midnight, is a bare day beside a time of day; a modified Julian date beside seconds of
    its day is a date. "" where one is empty.

    >>> joined(["2026-11-22", "08:39:04", "50"], 3), joined(["60100", "300.5"])
    ('2026-11-22 08:39:04.050', '2023-06-05T00:05:00.500000')
    """
    if not all(cells):
        return ""
    *first, last = cells
    counted = len(first) == 1 and first[0].lstrip("-").isdigit()
    if digits and last.isdigit() and (counted or _CLOCK.fullmatch(first[-1])):
        return f"{joined(first)}.{last.zfill(digits)}"
    if len(cells) == 2 and _MJD.fullmatch(cells[0]) and _OF_DAY.fullmatch(last):
        return (MJD + timedelta(int(cells[0]), float(last))).isoformat()
    return " ".join([cells[0].removesuffix("T00:00:00"), *cells[1:]])


def _coordinate(cell: str, axis: int) -> str:
    """Return one coordinate of a position; a cell that holds none as it is, so that it is told."""
    found = coordinates(cell)
    return found[axis] if axis < len(found) else cell
