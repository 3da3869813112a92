"""Times in a table: numbers, dates and times by ISO 8601, or times of day. Those that are dates count from 1970 in UTC."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable
from contextlib import suppress
from datetime import UTC, datetime, time
from itertools import islice
from typing import final

from attrs import frozen

from vedette_files.input_files import shown
from vedette_files.tables.numbers import Number, Row, plain_number

NUMBER, ZONED, UNZONED, OF_DAY = "a number", "a date and time with a zone", "a date and time without a zone", "a time of day"

EXAMPLES = {
    ZONED: "as 2026-11-22T08:39:04.5Z",
    UNZONED: "as 2026-11-22 08:39:04.5",
    OF_DAY: "as 08:39:04.5",
}

DAY = 86_400.0
"""s"""

MIDNIGHT = 600.0
"""Numbers that fall from so many s before the end of a day to as many after its begin are seconds of a day: by hand."""

LOOKED_AT = 50
"""So many times of a table decide in which form they all are."""

_OF_DAY = re.compile(r"(\d{1,2})([: ])(\d{1,2})(?:\2(\d{1,2}(?:\.\d*)?))?(?: ?([AP])M)?", re.IGNORECASE)

_OFFSET = re.compile(r"(\d.*\d) ([+-]\d{2}:?\d{2})(?: [A-Z]{3,5})?")
"""An offset behind a blank, and perhaps the name of its zone, as Go writes dates: 2026-11-22 08:39:04.5 +0000 UTC."""

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)

DATED = "s since 1970-01-01T00:00:00Z"
"""What a recording's note `time` says where its times are dates."""


def check_pattern(pattern: str) -> None:
    """Raise ValueError unless a pattern of dates has year, month and day, no name of a zone, and reads what it writes."""
    if "%Z" in pattern:
        cure = "write the zone out, as '%H:%M:%S PDT', and times are as if in UTC; %z reads offsets, as +02:00"
        raise ValueError(f"dates: must not hold %Z, got {pattern!r}: names of zones tell no time; {cure}")
    moment = datetime(2026, 11, 23, 4, 5, 6, tzinfo=UTC)
    try:
        read = datetime.strptime(moment.strftime(pattern), pattern)
    except (ValueError, re.error) as error:
        raise ValueError(f"dates: must be a pattern as '%d/%m/%Y %H:%M:%S', got {pattern!r}: {error}") from None
    if read.date() != moment.date():
        raise ValueError(f"dates: must hold a year, a month and a day, as '%d/%m/%Y %H:%M:%S', got {pattern!r}")


def stamp(cell: str, pattern: str = "") -> tuple[str, float]:
    """Return the form of a time, and its s since 1970 in UTC or since midnight; ValueError if it is none of them.

    A date and time without a zone is taken to be in UTC. With a `pattern` times are dates that are written so.
    """
    if pattern:
        found = datetime.strptime(cell, pattern)
        return (
            (UNZONED, (found.replace(tzinfo=UTC) - EPOCH).total_seconds())
            if found.tzinfo is None
            else (ZONED, (found - EPOCH).total_seconds())
        )
    try:
        return NUMBER, plain_number(cell)
    except ValueError:
        offset = _OFFSET.fullmatch(cell)
        cell = "".join(offset.groups()) if offset else f"{cell[:-4]}Z" if cell.endswith((" UTC", " GMT")) else cell
    try:
        date = datetime.fromisoformat(cell)
    except ValueError:
        return OF_DAY, _of_day(cell)
    if date.tzinfo is None:
        return UNZONED, (date.replace(tzinfo=UTC) - EPOCH).total_seconds()
    return ZONED, (date - EPOCH).total_seconds()


def _of_day(cell: str) -> float:
    """Return a time of day, by ISO 8601 or as 8:39:04 PM or 8 39 4, in s since midnight; ValueError if it is none."""
    found = _OF_DAY.fullmatch(cell)
    if found and (found[4] or found[5]):
        hours, minutes, seconds = int(found[1]), int(found[3]), float(found[4] or 0)
        if found[5] and not 1 <= hours <= 12:
            raise ValueError
        hours = hours % 12 + 12 * (found[5] in "pP") if found[5] else hours
        if hours >= 24 or minutes >= 60 or seconds >= 60:
            raise ValueError
        return 3600.0 * hours + 60.0 * minutes + seconds
    moment = time.fromisoformat(cell).replace(tzinfo=None)
    return (datetime.combine(EPOCH, moment, UTC) - EPOCH).total_seconds()


@frozen
class Form:
    """In which form a table's times are, the first of them in s, and the pattern of dates that are not by ISO 8601."""

    name: str
    first: float = 0.0
    pattern: str = ""

    @property
    def dated(self) -> bool:
        """Whether they are dates."""
        return self.name in (ZONED, UNZONED)


def form_of(cells: Iterable[str], pattern: str = "") -> Form:
    """Return the form that most of the first times have; that of numbers if none can be read."""
    patterns: list[tuple[str, float]] = []
    for cell in islice(filter(None, cells), LOOKED_AT):
        try:
            patterns.append(stamp(cell, pattern))
        except ValueError:
            continue
    if not patterns:
        return Form(UNZONED, 0.0, pattern) if pattern else Form(NUMBER)
    most = Counter(name for name, _ in patterns).most_common(1)[0][0]
    return Form(most, next(seconds for name, seconds in patterns if name == most), pattern)


def _patterns(cell: str) -> str:
    """Return which patterns read a date that is not by ISO 8601, in words; "" if none does."""
    day, month = ("%d{0}%m{0}%Y", "%m{0}%d{0}%Y")
    between = next((mark for mark in "./-" if mark in cell), "/")
    patterns = []
    for date in (day, month) if between == "/" else (day,):
        for clock in ("", " %H:%M:%S", " %H:%M", " %H:%M:%S.%f", " %I:%M:%S %p", " %I:%M %p"):
            with suppress(ValueError):
                datetime.strptime(cell, pattern := date.format(between) + clock)
                patterns.append(repr(pattern))
    told = " or ".join(patterns)
    return f"; dates = {told} in the source reads it, as --dates of `vedette new config` and `smooth`" if patterns else ""


@final
class Times:
    """A column of times, which are read row by row.

    Times of day go on past midnight: each is taken to lie within half a day of the one before it, the first of `near`. So do
    numbers, once they begin again as the seconds of a day do.
    """

    def __init__(self, column: Number, form: Form, near: float) -> None:
        self.name, self.title = column.name, column.title
        self._column, self._form, self._before = column, form, near
        self._of_day = form.name == OF_DAY

    def of(self, row: Row) -> float:
        """Return the row's time in s; ValueError if it is none, or not in the form of the others."""
        cell = row.cells[self.name]
        if self._form.name == NUMBER:
            try:
                plain_number(cell)
            except ValueError:
                told = f"{self.title} must be a number, or a date and time {EXAMPLES[ZONED]}, got {shown(cell)}"
                cure = "; name another column, or say how dates are written: dates in the source, or --dates"
                raise ValueError(told + (_patterns(cell) or cure)) from None
            return self._past_midnight(self._column.of(row))
        try:
            name, seconds = stamp(cell, self._form.pattern)
        except (ValueError, OverflowError):
            name, seconds = "", 0.0
        if name != self._form.name:
            written = f"written as {self._form.pattern}" if self._form.pattern else f"{EXAMPLES[self._form.name]}, like most"
            wanted = f"{self._form.name} {written}"
            raise ValueError(f"{self.title} must be {wanted}, got {shown(cell)}{_patterns(cell)}")
        return self._past_midnight(seconds)

    def _past_midnight(self, seconds: float) -> float:
        self._of_day = self._of_day or (0 <= seconds < MIDNIGHT and DAY - MIDNIGHT < self._before <= DAY)
        if self._of_day:
            seconds += DAY * round((self._before - seconds) / DAY)
        self._before = seconds
        return seconds
