"""Rows of a CSV file with a header line, or of a table in columns, by column name, one at a time."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain
from pathlib import Path

from attrs import frozen

from vedette.errors import ConfigError, InputError, Problem
from vedette.fields import ABSURD
from vedette.space import Axis, Space
from vedette.units import in_unit
from vedette_files.columnar import TablePath, header_and_rows, is_columnar
from vedette_files.composed import cell_of, made_of, perhaps_of
from vedette_files.input_files import lines, shown

WIDEST = 131_072
"""Characters of a cell; what Python's csv module reads unless it is told otherwise, for the whole process."""

LARGEST = {"latitude": 90.0, "longitude": 360.0}
"""Limits of some columns, in deg."""

LEAST = {"range": 0.0}
"""What some columns are at least."""

UNCLOSED = f"a quotation mark is not closed, or a cell has more than {WIDEST:,} characters"


_COMMA = re.compile(r"([-+\d:T ]*),(\d[\deE:Z+-]*)")
"""A number, or a time with a part of a second, that has a comma where a program wants a point."""

_THOUSANDS = re.compile(r"[-+]?\d{1,3}([,' ]\d{3})+(\.\d*)?")
"""A number whose digits are grouped."""

_SEPARATOR_LINE = re.compile(r'"?sep=.?"?', re.IGNORECASE)
"""What Excel writes above a header to say what stands between columns."""

_DEGREES = re.compile(
    r"(?P<before>[NSEWnsew])?\s*(?P<sign>[-+])?(?P<degrees>\d+(?:\.\d+)?)\s*(?:°|º|deg)?"
    r"(?:[\s-]*(?P<minutes>\d+(?:\.\d+)?)\s*(?:['\u2032\u2019]|min)?(?:[\s-]*(?P<seconds>\d+(?:\.\d+)?)\s*(?:\"|\u2033|''|\u201d|sec)?)?)?"
    r"\s*(?P<after>[NSEWnsew])?"
)
"""A latitude or longitude with letters for the hemisphere, or minutes and seconds."""

_BETWEEN = re.compile(r"[,;\t| ]")


@frozen
class Dialect:
    """How a file writes its rows: what stands between columns, and in decimal numbers."""

    delimiter: str = ","
    decimal: str = "."

    def cells(self, line: str) -> list[str] | None:
        """Return the cells of a line, with decimal points; None as `cells_of` does."""
        cells = cells_of(line.lstrip("# ").rstrip() if self.delimiter == " " else line, self.delimiter)
        if self.decimal == "." or cells is None:
            return cells
        return [_COMMA.sub(r"\1.\2", cell) if _COMMA.fullmatch(cell) else cell for cell in cells]


COMMAS = Dialect()
"""What most files are."""


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
            empty = "; leave the cells of a row empty where nothing was measured" if math.isnan(number) else ""
            raise ValueError(f"{self.title} must be a finite number of at most {ABSURD:g}, got {shown(cell)}{empty}")
        if self.largest is not None and abs(number) * self.factor > self.largest:
            bounds = f"from {-self.largest / self.factor:.6g} to {self.largest / self.factor:.6g}"
            other = "; is it the longitude's column?" if self.largest == 90 and abs(number) * self.factor <= 360 else ""
            if not other and self.factor == 1:
                minutes = abs(number) < 18_100 and abs(number) % 100 < 60
                letter = "N" if self.largest == 90 else "E"
                other = (
                    f"; if these are degrees and minutes, say so by a letter: {cell.lstrip('-')}{letter}" if minutes else ""
                )
                units = "--units latitude='1e-7 deg',longitude='1e-7 deg' reads it, or 1.6666667e-6 deg if AIS sent it"
                other = f"; {units}" if abs(number) > 1e6 else other
            raise ValueError(f"{self.title} must be {bounds}, got {shown(cell)}{other}")
        if number < self.least:
            raise ValueError(f"{self.title} must be >= {self.least:g}, got {shown(cell)}")
        return number * self.factor

    def _advice(self, cell: str) -> str:
        """Return what to write instead of a cell that is no number, or ""."""
        if _COMMA.fullmatch(cell):
            return '; decimal = "," reads it'
        if _THOUSANDS.fullmatch(cell):
            return f"; write it without what groups its digits, {re.sub('[^-+0-9.]', '', cell)}"
        number, _, unit = cell.partition(" ")
        if is_number(number) and unit.isalpha():
            return f"; write the number alone, {number}: `units` says that it is in {unit}"
        if self.largest is not None and cell[:1].isdigit():
            return "; write degrees with decimals, or as 59 25.955 N"
        return ""


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


def rows(path: TablePath, wanted: Mapping[str, str], place: str, dialect: Dialect, refused: list[Problem]) -> Iterator[Row]:
    """Yield the rows of a table without blank lines; rows of another length than the header's are added to `refused`.

    Comments may stand above the header, and empty cells beyond its last column.

    wanted: name in the config -> title of the column; `place` is the config's table that names them, for messages. Each
    line is a row by itself, so a stray quotation mark costs one row. InputError: no file, no rows, a header that lacks a
    column or has it twice.
    """
    if not isinstance(path, Path) or is_columnar(path):
        yield from _columnar(path, wanted, place)
        return
    top, first, given = header_line(lines(path))
    header = dialect.cells(first)
    if header is None:
        raise InputError(f"{path}:{top}: the header has {UNCLOSED.replace(' is not', ' that is not')}")
    if not header:
        raise InputError(f"{path}: holds blank lines only, and must begin with a header line: the titles of the columns")
    _check_titles(header, f"{path}:{top}", wanted, place)
    where = {name: cell_of(title, header) for name, title in wanted.items()}
    empty = True
    for number, line in given:
        if not line.strip():
            continue
        empty = False
        cells = fitted(dialect.cells(line), len(header))
        line_place = f"{path.name}:{number}"
        if cells is None:
            refused.append(Problem(line_place, UNCLOSED))
        elif len(cells) != len(header):
            text = f"must have {len(header)} columns as in the header, got {len(cells)}"
            refused.append(Problem(line_place, text + _too_many(cells, len(header))))
        else:
            yield Row(line_place, {name: cell(cells) for name, cell in where.items()})
    if empty:
        raise InputError(f"{path}: has a header and no rows")


def _too_many(cells: Sequence[str], width: int) -> str:
    """Return what may be wrong with a row that has more cells than the header, each a whole number; or ""."""
    split = width < len(cells) <= 2 * width and all(cell.strip(" +-").isdigit() for cell in cells)
    return "; decimal commas between commas cannot be read: put semicolons between columns" if split else ""


def header_line(given: Iterator[tuple[int, str]]) -> tuple[int, str, Iterator[tuple[int, str]]]:
    """Return the number and the text of the header's line, and the lines below it.

    Above it may stand blank lines, Excel's `sep=;` and comments that begin with #. The last comment is the header if
    numbers follow it: so numpy.savetxt writes one.
    """
    comment = (1, "")
    for number, line in given:
        text = line.strip()
        if text.startswith("#"):
            comment = (number, line)
        elif text and not _SEPARATOR_LINE.fullmatch(text):
            if comment[1] and any(map(is_number, _BETWEEN.split(text))):
                return *comment, chain([(number, line)], given)
            return number, line, given
    return *comment, given


def fitted(cells: list[str] | None, width: int) -> list[str] | None:
    """Return a row's cells without empty ones beyond the header's: some programs end a row with a delimiter."""
    return cells if cells is None or any(cells[width:]) else cells[:width]


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
    if found is None or not (letter or found["minutes"]):
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


def _columnar(path: TablePath, wanted: Mapping[str, str], place: str) -> Iterator[Row]:
    """Yield the rows of a Parquet file or a data frame, the first of which is row 1."""
    parts = {part for title in wanted.values() for part in perhaps_of(title)}
    header, given = header_and_rows(path, parts)
    _check_titles(header, str(path), wanted, place)
    read = [title for title in header if title in parts]
    where = {name: cell_of(title, read) for name, title in wanted.items()}
    number = 0
    for number, cells in enumerate(given, 1):
        yield Row(f"{path.name}:row {number}", {name: cell(cells) for name, cell in where.items()})
    if number == 0:
        raise InputError(f"{path}: has a header and no rows")


def _check_titles(header: Sequence[str], where: str, wanted: Mapping[str, str], place: str) -> None:
    for name, wish in wanted.items():
        for title in made_of(wish, header) or (wish,):
            if header.count(title) == 1:
                continue
            there = "no column" if title not in header else "more than one column"
            found = f"the columns are {listed(header)}" if len(header) > 1 else f"the only column is {shown(header[0])}"
            cure = _delimiter(header[0]) if len(header) == 1 else ""
            if title in header:
                cure = "; rename all but one"
            elif all(map(is_number, header)):
                cure = "; these are numbers: write the titles of the columns above them"
            elif any("\0" in each for each in header):
                cure = "; this looks like UTF-16 without a byte order mark: save the table in UTF-8"
            raise InputError(f"{where}: there is {there} {title!r}, which {place}.{name} asks for; {found}{cure}")


def _delimiter(header: str) -> str:
    """Return which delimiter parts a header that has but one column."""
    found = [mark for mark in (";", "\t", "|", ",") if mark in header]
    told = f"{found[0]!r} seems to stand between columns" if len(found) == 1 else "what stands between columns?"
    return f"; {told}: source.delimiter states it" + (", as ' ' for blanks" if not found and " " in header else "")


def listed(header: Sequence[str]) -> str:
    """Return a header as a message shows it."""
    named = ", ".join(title if len(title) <= 60 and title.isprintable() else shown(title) for title in header[:20])
    return named if len(header) <= 20 else f"{named} and {len(header) - 20} more"


def header_of(path: Path, line: str, wanted: Sequence[str], optional: Sequence[str] = ()) -> list[str]:
    """Return the titles in a file's first line; InputError if one is lacking, or one that is read stands twice."""
    header = cells_of(line)
    if header is None:
        raise InputError(f"{path}:1: {UNCLOSED}")
    lacking = [title for title in wanted if title not in header]
    if lacking:
        told = f"must have the columns {', '.join(wanted)}; lacks {', '.join(lacking)}"
        raise InputError(f"{path}:1: {told}, got {shown(line.strip())}")
    twice = [title for title in (*wanted, *optional) if header.count(title) > 1]
    if twice:
        raise InputError(f"{path}:1: must have each column once; has {', '.join(twice)} more often")
    return header


def cells_of(line: str, delimiter: str = ",") -> list[str] | None:
    """Return the cells of a line, stripped; None if a quotation mark is not closed or a cell is wider than WIDEST."""
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))]
    except (csv.Error, StopIteration):
        return None
