"""How the dates of a table are written, where it is not by ISO 8601: 23/11/2026 08:39, 11/23/26 8:39:04 PM, 2026112308."""

from __future__ import annotations

import re
from collections.abc import Sequence
from datetime import datetime
from itertools import pairwise

_DATE = re.compile(
    r"(?P<first>\d{1,4})(?P<between>[./-]|\s)(?P<second>\d{1,2}|[A-Za-z]{3})(?P=between)(?P<third>\d{1,4})"
    r"(?P<gap>T|,? )(?P<hour>\d{1,2}):\d\d(?P<seconds>:\d\d(?P<part>\.\d{1,6})?)?(?P<half> ?[APap][Mm])?"
)

_SPELT = ("%a %b %d %H:%M:%S{} %Y", "%a, %d %b %Y %H:%M:%S{}")
"""As Unix and letters spell dates, with a zone in {}: Mon Nov 23 08:39:04 PDT 2026; Mon, 23 Nov 2026 08:39:04 +0000."""

_ZONE = re.compile(r"(?<=\d) [A-Z]{1,5}\b")

_COMPACT = re.compile(r"(19|20)\d{6}(\d\d){0,3}")

_PLAIN = re.compile(r"(\d{6}|\d{8}) (\d{4}|\d{6}(\.\d+)?)")

_CLOCK_FIRST = re.compile(r"(\d{1,2}:\d\d(?::\d\d(?:\.\d+)?)?(?: ?[APap][Mm])?) (\S.*)")
_DAY_FIRST = re.compile(r"(%\w[^ %]%\w[^ %]%\w),? (%[HI]:%M(?::%S(?:\.%f)?)?(?: ?%p)?)")

_DAY = re.compile(r"\d{1,4}(?P<between>[./-])(\d{1,2}|[A-Za-z]{3})(?P=between)\d{1,4}(T00:00:00)?")
_OF_DAY = re.compile(r"\d{1,2}:\d\d(:\d\d(\.\d*)?)?( ?[APap][Mm])?Z?")

_HOURS_AND_MINUTES = re.compile(r"\d\d:\d\d")

PLAIN_DAYS = ("%y%m%d", "%d%m%y", "%m%d%y")
"""How dates of six digits are written."""

ENOUGH = 0.9
"""Such a part of the cells are read by a pattern that counts."""


def is_day(cell: str) -> bool:
    """Return whether a cell is a date without a time of day."""
    return _DAY.fullmatch(cell) is not None


def is_plain_day(cell: str) -> bool:
    """Return whether a cell is a date without marks, as 18510625."""
    return re.fullmatch(r"(1[6-9]|20)\d\d(0[1-9]|1[0-2])([0-2]\d|3[01])", cell) is not None


def is_short_day(cell: str) -> bool:
    """Return whether a cell is as long as a date without marks and century, as 510625."""
    return re.fullmatch(r"\d{6}", cell) is not None


def is_plain_clock(cell: str) -> bool:
    """Return whether a cell is a time of day without marks, as 0600 or 060015.5."""
    return re.fullmatch(r"([01]\d|2[0-3])[0-5]\d([0-5]\d(\.\d*)?)?", cell) is not None


def is_moment(cell: str) -> bool:
    """Return whether a cell is a date with a time of day, perhaps without marks, as 20261123083904."""
    return _DATE.match(cell) is not None or (is_plain_day(cell[:8]) and len(cell) == 14 and is_plain_clock(cell[8:]))


def is_time_of_day(cell: str) -> bool:
    """Return whether a cell is a time of day without a date."""
    return _OF_DAY.fullmatch(cell) is not None


def pattern_of(cells: Sequence[str]) -> tuple[str, str]:
    """Return the pattern of dates and what was assumed of it; "" if the cells are no dates, or by ISO 8601.

    Of day and month, the day comes first, beside AM and PM the month, unless its place holds numbers above 12, or times then
    go back more often or span more: rows stand in the order of time, within days rather than months.
    """
    given = [cell.strip() for cell in cells if cell.strip()]
    if given and (ahead := _CLOCK_FIRST.fullmatch(given[0])) and not is_time_of_day(ahead[0]):
        return _clock_first(given)
    if given and (parts := _PLAIN.fullmatch(given[0])):
        clock = "%H%M" if len(parts[2]) == 4 else "%H%M%S.%f" if parts[3] else "%H%M%S"
        return _likeliest(given, [f"{day} {clock}" for day in (("%Y%m%d",) if len(parts[1]) == 8 else PLAIN_DAYS)])
    if given and all(_HOURS_AND_MINUTES.fullmatch(cell) for cell in given):
        return "", "times are hours and minutes; write minutes and seconds as 00:59:59"
    if given and _COMPACT.fullmatch(given[0]):
        pattern = "%Y%m%d%H%M%S"[: len(given[0]) - 2]
        if len(_read(given, pattern)) == len(given):
            return pattern, f"dates are written as {pattern}"
    if given and (spelt := _spelt(given)):
        zone = _ZONE.search(spelt.replace("%S", "00")) if "%z" not in spelt else None
        unread = zone and zone[0].strip() not in ("UTC", "GMT", "Z")
        return spelt, f"{zone[0].strip()} is no zone that is read: times are as if in UTC" if zone and unread else ""
    if not given or (parts := _DATE.fullmatch(given[0])) is None or _by_iso(given):
        return "", ""
    between, whole = parts["between"], len(parts["first"]) == 4
    year = "%Y" if whole or len(parts["third"]) == 4 else "%y"
    month = "%b" if parts["second"].isalpha() else "%m"
    by_day = [("%d", month, year)] if month == "%b" else [("%d", month, year), (month, "%d", year)]
    orders = [(year, month, "%d")] if whole else by_day[::-1] if parts["half"] else by_day  # AM and PM are American
    seconds = ":%S.%f" if parts["part"] else ":%S" if parts["seconds"] else ""
    clock = f"{'%I' if parts['half'] else '%H'}:%M{seconds}"
    half = "" if not parts["half"] else " %p" if parts["half"].startswith(" ") else "%p"
    patterns = [f"{between.join(order)}{parts['gap']}{clock}{half}" for order in orders]
    return _likeliest(given, patterns)


def _likeliest(given: Sequence[str], patterns: Sequence[str]) -> tuple[str, str]:
    """Return which of several patterns most likely wrote dates, and what was assumed; "" if none did."""
    read = {pattern: moments for pattern in patterns if len(moments := _read(given, pattern)) >= ENOUGH * len(given)}
    if not read:
        return "", ""
    best = min(read, key=lambda pattern: (-len(read[pattern]), _backwards(read[pattern]), _span(read[pattern])))
    others = " or ".join(f"'{other}'" for other in read if other != best)
    return best, f"dates are written as {best}; if not, say --dates {others}" if others else ""


def _clock_first(given: Sequence[str]) -> tuple[str, str]:
    """Return the pattern of dates behind times of day, as 08:39:04 23-Nov-2026, and what was assumed of it."""
    turned = [_CLOCK_FIRST.sub(r"\2 \1", cell) for cell in given]
    found, told = ("%Y-%m-%d %H:%M:%S", "") if _by_iso(turned) else pattern_of(turned)
    return _DAY_FIRST.sub(r"\2 \1", found), _DAY_FIRST.sub(r"\2 \1", told)


def _spelt(cells: Sequence[str]) -> str:
    """Return the pattern of dates that begin with the day of the week; "" if they are others."""
    zone = _ZONE.search(cells[0])
    for each in _SPELT:
        for pattern in (each.format(" %z"), each.format(" GMT%z"), each.format(zone[0] if zone else "")):
            if len(_read(cells, pattern)) >= ENOUGH * len(cells):
                return pattern
    return ""


def _by_iso(cells: Sequence[str]) -> bool:
    """Return whether the first date is by ISO 8601."""
    try:
        datetime.fromisoformat(cells[0])
    except ValueError:
        return False
    return True


def _read(cells: Sequence[str], pattern: str) -> list[datetime]:
    moments = []
    for cell in cells:
        try:
            moments.append(datetime.strptime(cell, pattern))
        except ValueError:
            continue
    return moments


def _backwards(moments: Sequence[datetime]) -> int:
    return sum(after < before for before, after in pairwise(moments))


def _span(moments: Sequence[datetime]) -> float:
    return (max(moments) - min(moments)).total_seconds()
