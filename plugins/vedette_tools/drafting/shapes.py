"""Times and positions that a table holds in several columns, or in the cells of one."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import takewhile

from attrs import evolve

from vedette_files.tables.composed import PARTS, PLUS, cell_of, coordinates, digits_of
from vedette_files.tables.numbers import is_number
from vedette_files.tables.times import stamp
from vedette_tools.drafting.dates import (
    is_day,
    is_moment,
    is_plain_clock,
    is_plain_day,
    is_short_day,
    is_time_of_day,
)
from vedette_tools.drafting.titles import MOVING, Meaning, by_words_of, meaning, words_of

Columns = Mapping[str, Sequence[str]]

CALENDAR = (
    ("%Y", ("year", "yyyy", "yr", "jahr", "annee", "ano", "anno")),
    ("%m", ("month", "mon", "mm", "monat", "mois", "mes", "mese")),
    ("%d", ("day", "dd", "tag", "jour", "dia", "giorno")),
    ("%H", ("hour", "hours", "hh", "hr", "stunde", "heure", "hora", "ora")),
    ("%M", ("minute", "minutes", "min", "mi", "minuto", "minuti")),
    ("%S", ("second", "seconds", "sec", "secs", "ss", "sekunde", "seconde", "segundo", "secondo")),
)
"""The parts of a date and time, from the largest on, and what columns of each are called."""

LONGITUDE_FIRST = ("coordinates", "coordinate", "coords", "lonlat", "lnglat", "geom", "geometry", "wkt")
"""Words of titles whose pairs of degrees begin with the longitude; others begin with the latitude."""

DATES = ("date", "day", "datum", "fecha")
"""Words of titles of dates, which may be six digits."""

SECONDS = (["s"], ["sec"], ["secs"], ["seconds"])
"""Last words of titles of whole seconds, which are a time where another column has the parts of one."""

NO_PLACE = frozenset((
    *MOVING, "a", "b", "q", "w", "gyro", "mag", "magnetic", "magnetometer", "force", "torque", "quat", "rot", "rotation",
    "angular", "ang", "tilt", "size", "width", "length", "error", "err", "std", "sd", "sigma", "var", "cov", "covariance",
    "offset", "delta", "d", "min", "max", "scale", "dim", "normal", "accelerometer", "lin", "linear",
))  # fmt: skip
"""Words beside an x that is no place."""

UNIT = re.compile(r"[\[(][^\])]{2,}[\])]")

PARTS_OF_DEGREES = (("m", "min", "mins", "minute", "minutes"), ("s", "sec", "secs", "second", "seconds"))
"""Last words of titles of minutes and seconds beside whole degrees."""

MILLI = 3
"""Digits of ms."""

MOST = 0.9
"""Such a part of a column's cells are what it holds."""


def time_of(columns: Columns, found: Meaning | None) -> tuple[Meaning | None, str]:
    """Return the column of the time, which may be made of several, and the pattern of dates if it is known already."""
    by_word = {re.sub("_(utc|gmt)$", "", words): title for words, title in by_words_of(columns).items()}
    parts = [(pattern, next((by_word[name] for name in names if name in by_word), "")) for pattern, names in CALENDAR]
    if "MM" in columns and "mm" in columns:  # months and minutes
        parts[1], parts[4] = ("%m", "MM"), ("%M", "mm")
    elif parts[3][1] and not (parts[0][1] or parts[4][1]):  # hh, mm, ss
        parts[1], parts[4] = ("%m", ""), ("%M", parts[1][1])
    whole = found is not None and not _most(columns[found.title], is_day) and found.title not in dict(parts).values()
    if all(title for _, title in parts[3:]) and not (whole or any(title for _, title in parts[:3])):
        return _time(PLUS.join(title for _, title in parts[3:])), ""
    if all(title for _, title in parts[:3]) and not whole:
        present = [*takewhile(lambda part: part[1], parts)]  # minutes without hours tell nothing
        last = present[-1]
        decimal = ".%f" if last[0] == "%S" and any("." in cell for cell in columns[last[1]]) else ""
        return _time(PLUS.join(title for _, title in present)), " ".join(pattern for pattern, _ in present) + decimal
    if found is None:
        found = next((_time(title) for title in columns if _counts_seconds(title) and _rest(title, columns)), None)
    dates = is_moment, is_day
    if found is None:
        found = next((_time(title) for holds in dates for title, cells in columns.items() if _most(cells, holds)), None)
    if found is None:
        return None, ""
    if plain := _without_marks(found, columns):
        return _time(plain), ""
    days = [title for title, cells in columns.items() if _most(cells, is_day)]
    if len(days) == 1 and _most(columns[found.title], is_time_of_day):
        found = _time(days[0])
    if _most(columns[found.title], is_day):
        clock = next((title for title, cells in columns.items() if _most(cells, is_time_of_day)), "")
        if clock and len(set(columns[found.title])) == 1 and _passes_midnight(columns[clock]):
            return _time(clock), ""  # the day is that of the beginning, and midnight passed
        rest = _rest(clock, columns) if clock else ""
        return (_time(PLUS.join(filter(None, (found.title, clock, rest)))), "") if clock else (found, "")
    if julian := _julian(found, columns):
        return _time(julian), ""
    return with_rest(found, columns), ""


def _without_marks(found: Meaning, columns: Columns) -> str:
    """Return a column of dates and one of times of day that are written without marks, of which one was found; or ""."""
    called = {title: cells for title, cells in columns.items() if meaning(title).axis == "time"}
    days = [title for title, cells in called.items() if _most(cells, is_plain_day)]
    days += [title for title, cells in called.items() if {*DATES} & {*words_of(title)} and _most(cells, is_short_day)]
    clocks = [title for title, cells in called.items() if title not in days and _most(cells, is_plain_clock)]
    return PLUS.join((days[0], clocks[0])) if days and clocks and found.title in days + clocks else ""


def _julian(found: Meaning, columns: Columns) -> str:
    """Return a column of modified Julian dates and one of seconds of the day, of which one was found; or ""."""
    called = {title: cells for title, cells in columns.items() if meaning(title).axis == "time"}
    days = [title for title in called if meaning(title).unit == "86400 s" and _most(called[title], _is_whole)]
    clocks = [title for title in called if title not in days and _most(called[title], is_number)]
    return PLUS.join((days[0], clocks[0])) if days and clocks and found.title in (days[0], clocks[0]) else ""


def _passes_midnight(clocks: Sequence[str]) -> bool:
    """Return whether times of day end before they began."""
    try:
        return stamp(clocks[-1])[1] < stamp(clocks[0])[1]
    except ValueError:
        return clocks[-1] < clocks[0]


def with_rest(found: Meaning, columns: Columns) -> Meaning:
    """Return a column of whole seconds with the one that counts parts of a second beside them, if there is one."""
    whole, stem = found.title, words_of(found.title)[:-1]
    if digits_of(whole):
        whole = next((title for title in columns if _counts_seconds(title) and words_of(title)[:-1] == stem), whole)
    rest = _rest(whole, columns)
    return evolve(found, title=PLUS.join((whole, rest)), unit="s") if rest else found


def position_of(columns: Columns, degrees: Callable[[Sequence[str], Sequence[str]], bool]) -> dict[str, Meaning]:
    """Return x and y that the cells of one column hold, as POINT(10.5 59.4); nothing if none does.

    `degrees` says whether two columns of numbers are a longitude and a latitude.
    """
    title = next((title for title, cells in columns.items() if _most(cells, lambda cell: bool(coordinates(cell)))), "")
    if not title:
        return {}
    pair = [f"{title}.{axis}" for axis in PARTS[:2]]
    first, second = (_cells(each, columns) for each in pair)
    told = any(cell.lstrip().upper().startswith(("POINT", "SRID")) for cell in columns[title])
    told = told or any(word in LONGITUDE_FIRST for word in words_of(title))
    if not told and degrees(second, first):
        pair = pair[::-1]
    return {axis: Meaning(name, axis, "", False, True) for axis, name in zip("xy", pair, strict=True)}


def pairs_of(columns: Columns, below: Sequence[str] = ()) -> list[dict[str, Meaning]]:
    """Return columns whose titles are alike but for x, y and z if there is one, and may be a position: gaze X and gaze Y.

    below: the row of units, or nothing.
    """
    held = {title for title, cells in columns.items() if _most(cells, is_number)}
    by_word: dict[tuple[str, ...], str] = {}
    for title in columns:
        by_word.setdefault(tuple(words_of(title)), title)
    found = []
    for words, title in by_word.items():
        other = by_word.get(tuple("y" if word == "x" else word for word in words), "")
        if words.count("x") == 1 and "y" not in words and not NO_PLACE & {*words} and {title, other} <= held:
            unit = UNIT.search(title)
            stated = dict(zip(columns, below, strict=False)).get(title, "")
            as_x = meaning(f"x {unit[0]}" if unit else "x", stated)
            pair = {"x": evolve(as_x, title=title), "y": evolve(as_x, title=other, axis="y")}
            up = by_word.get(tuple("z" if word == "x" else word for word in words), "")
            found.append(pair | ({"z": evolve(as_x, title=up, axis="z")} if up in held else {}))
    return found


def with_hemisphere(given: Meaning, columns: Columns) -> Meaning:
    """Return a latitude or longitude with the columns beside it: of minutes and seconds below whole degrees, and of letters
    for north or south, east or west.
    """
    titles = list(columns)
    after = titles.index(given.title) + 1 if given.title in titles else len(titles)
    parts = [given.title]
    for ends in PARTS_OF_DEGREES if _most(columns.get(given.title, ()), _is_whole) else ():
        *first, last = words_of("".join(titles[after : after + 1])) or [""]
        if last in ends and first[:1] == words_of(given.title)[:1] and _most(columns[titles[after]], _is_below_sixty):
            parts.append(titles[after])
            after += 1
    letters = "NSns" if given.axis == "latitude" else "EWew"
    if _most(columns.get("".join(titles[after : after + 1]), ()), lambda cell: len(cell) == 1 and cell in letters):
        parts.append(titles[after])
    return evolve(given, title=PLUS.join(parts))


def _is_whole(cell: str) -> bool:
    return cell.strip().lstrip("+-").isdigit()


def _is_below_sixty(cell: str) -> bool:
    return cell.replace(".", "", 1).isdigit() and float(cell) < 60


def with_made(columns: dict[str, list[str]], given: Mapping[str, Meaning]) -> dict[str, list[str]]:
    """Return the columns with those that are made of others."""
    return columns | {each.title: _cells(each.title, columns) for each in given.values() if each.title not in columns}


def _cells(title: str, columns: Columns) -> list[str]:
    read = cell_of(title, list(columns))
    return [read(row) for row in zip(*columns.values(), strict=True)]


def _time(title: str) -> Meaning:
    return Meaning(title, "time", "", False, True)


def _counts_seconds(title: str) -> bool:
    return words_of(title)[-1:] in SECONDS


def _rest(seconds: str, columns: Columns) -> str:
    """Return the column that counts parts of a second beside one of whole seconds, or of times of day; or "".

    Of ms, which others count, too, the title begins as theirs does, and they are not the same in all rows.
    """
    whole, of_day = _most(columns[seconds], str.isdigit), _most(columns[seconds], _is_whole_clock)
    for title, cells in columns.items():
        digits = digits_of(title)
        alike = words_of(title)[:-1] == words_of(seconds)[:-1] and len({*cells}) > 1
        if not digits or title == seconds or ((of_day or digits == MILLI) and not alike):
            continue
        if _most(cells, lambda cell: cell.isdigit() and len(cell) <= digits):  # noqa: B023
            return title if whole or of_day else ""
    return ""


def _is_whole_clock(cell: str) -> bool:
    return is_time_of_day(cell) and "." not in cell


def _most(cells: Sequence[str], holds: Callable[[str], bool]) -> bool:
    """Return whether most cells that are not empty are so, and there are some."""
    there = [cell for cell in cells if cell]
    return bool(there) and sum(map(holds, there)) >= MOST * len(there)
