"""Numbers in the cells of a CSV file, with their units and limits, also as people and programs write them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

from attrs import frozen

from vedette import Axis, ConfigError, Problem, Space
from vedette.fields import ABSURD
from vedette.units import in_unit
from vedette_files.input_files import shown

LARGEST = {"latitude": 90.0, "longitude": 360.0}
"""Limits of some columns, in deg."""

NOT_KNOWN = 91.0
"""What AIS sends in place of a latitude that is not known, in deg: ITU-R M.1371."""

LEAST = {"range": 0.0}
"""What some columns are at least."""

COMMA = re.compile(r"([-+\d:T ]*),(\d[\deE:Z+-]*)")
"""A number, or a time with a part of a second, that has a comma where a program wants a point."""

_THOUSANDS = re.compile(r"[-+]?\d{1,3}(?:([,' ]\d{3})+(\.\d*)?|(\.\d{3})+(,\d*))")
"""A number whose digits are grouped, by points where its decimals stand behind a comma."""

_DEGREES = re.compile(
    r"(?P<before>[NSEWnsew])?\s*(?P<sign>[-+])?(?P<degrees>\d+(?:\.\d+)?)\s*(?:°|º|deg)?"
    r"(?:[\s-]*(?P<minutes>\d+(?:\.\d+)?)\s*(?:['\u2032\u2019]|min)?(?:[\s-]*(?P<seconds>\d+(?:\.\d+)?)\s*(?:\"|\u2033|''|\u201d|sec)?)?)?"
    r"\s*(?P<after>[NSEWnsew])?"
)
"""A latitude or longitude with letters for the hemisphere, or minutes and seconds."""


@frozen
class Row:
    """One line: its place, and the requested cells, stripped, by the name in the config."""

    place: str
    cells: Mapping[str, str]


@frozen
class Number:
    """A column of numbers: its `name` in the config, its title in the file, and the factor to SI units."""

    name: str
    title: str
    factor: float
    largest: float | None = None
    least: float = -math.inf

    def of(self, row: Row) -> float:
        """Return the row's number; ValueError if it is not a number or is too large."""
        cell = row.cells[self.name]
        try:
            number = plain_number(cell) if self.largest is None else degrees(cell)
        except ValueError:
            raise ValueError(f"{self.title} must be a number, got {shown(cell)}{self._advice(cell)}") from None
        if not abs(number) * self.factor <= ABSURD:  # also False for NaN
            empty = "" if math.isfinite(number) else "; leave the cells of a row empty where nothing was measured"
            raise ValueError(f"{self.title} must be a finite number of at most {ABSURD:g}, got {shown(cell)}{empty}")
        if self.largest is not None and abs(number) * self.factor > self.largest:
            bounds = f"from {-self.largest / self.factor:.6g} to {self.largest / self.factor:.6g}"
            other = "; AIS sends it where a position is not known" if abs(number) * self.factor == NOT_KNOWN else ""
            other = other or (
                "; is it the longitude's column?" if self.largest == 90 and abs(number) * self.factor <= 360 else ""
            )
            if not other and self.factor == 1:
                minutes = abs(number) < 18_100 and abs(number) % 100 < 60
                letter = "N" if self.largest == 90 else "E"
                other = (
                    f"; if these are degrees and minutes, say so by a letter: {cell.lstrip('-')}{letter}" if minutes else ""
                )
                units = "--units latitude='1e-7 deg',longitude='1e-7 deg' reads it"
                units += ", or 1.6666667e-6 deg if AIS sent it, 8.3819032e-8 deg if it is in semicircles, as of FIT"
                other = f"; {units}" if abs(number) > 1e6 else other
            raise ValueError(f"{self.title} must be {bounds}, got {shown(cell)}{other}")
        if number < self.least:
            raise ValueError(f"{self.title} must be >= {self.least:g}, got {shown(cell)}")
        return number * self.factor

    def _advice(self, cell: str) -> str:
        """Return what to write instead of a cell that is no number, or ""."""
        if COMMA.fullmatch(cell):
            return '; decimal = "," reads it'
        if grouped := _THOUSANDS.fullmatch(cell):
            digits = "[^-+0-9,]" if grouped[4] else "[^-+0-9.]"
            return f"; write it without what groups its digits, {re.sub(digits, '', cell)}"
        number, _, unit = cell.partition(" ")
        if is_number(number) and unit.isalpha():
            return f"; write the number alone, {number}: `units` says that it is in {unit}"
        if self.largest is not None and cell[:1].isdigit():
            return "; write degrees with decimals, or as 59 25.955 N"
        return "; write one, as 12.5, or name another column" if cell else "; name another column"


def numbers(axes: Space, time: str, columns: Mapping[str, str], units: Mapping[str, str], place: str) -> dict[str, Number]:
    """Return a column of numbers for each axis, and for the time unless its title is empty.

    `units` may name the unit of a column, also a multiple of one, as "0.1 m". ConfigError if it is unknown, or for a
    column that is not read.
    """
    named = [Axis("time", "s"), *axes.axes] if time else list(axes.axes)
    known = [axis.name for axis in named]
    problems = [
        Problem(f"{place}.units.{name}", f"no such column is read; those are {', '.join(known)}")
        for name in units
        if name not in known
    ]
    numbers = {}
    for axis in named:
        name, title = ("time", time) if axis.name == "time" else (f"columns.{axis.name}", columns[axis.name])
        try:
            unit = units.get(axis.name, axis.unit)
            multiple = unit[:1].isdigit() and unit != axis.unit
            factor = in_unit(unit if multiple else f"1 {unit}", axis.unit)
            if factor <= 0:
                raise ValueError(f"must be a unit, or a multiple of one above 0, got {unit!r}")
            numbers[axis.name] = Number(name, title, factor, LARGEST.get(axis.name), LEAST.get(axis.name, -math.inf))
        except ValueError as error:
            text = str(error).replace(repr(f"1 {unit}"), repr(unit))
            problems.append(Problem(f"{place}.units.{axis.name}", text))
    if problems:
        raise ConfigError(problems)
    return numbers


def plain_number(cell: str) -> float:
    """Return the number in a cell; ValueError if it is none, or one as Python alone writes it: 1_000."""
    if "_" in cell:
        raise ValueError
    return float(cell)


def degrees(cell: str) -> float:
    """Return a latitude or longitude in degrees, also as 59°25'57.3"N, 59 25.955 N, or 5925.955N as GPS receivers write it.

    ValueError if the cell is none.

    >>> round(degrees("10 28.8 W"), 4), round(degrees("05925.955 N"), 4)
    (-10.48, 59.4326)
    """
    try:
        return plain_number(cell)
    except ValueError:
        found = _DEGREES.fullmatch(cell.strip())
    letter = (found["before"] or found["after"] or "") if found else ""
    if found is None or not (letter or found["minutes"] or cell.strip()[-1] in "°º"):
        raise ValueError
    whole, minutes, seconds = (float(found[part] or 0) for part in ("degrees", "minutes", "seconds"))
    if not found["minutes"] and "." in found["degrees"] and len(found["degrees"].partition(".")[0]) > 3:
        whole, minutes = divmod(whole, 100.0)  # two digits of minutes before the point
    if minutes >= 60 or seconds >= 60:
        raise ValueError
    size = whole + minutes / 60 + seconds / 3600
    return -size if letter.upper() in ("S", "W") or found["sign"] == "-" else size


def is_number(cell: str) -> bool:
    """Return whether a cell holds a finite number."""
    try:
        return math.isfinite(plain_number(cell))
    except ValueError:
        return False
