"""Rows of a CSV file with a header line, or of a table in columns, by column name, one at a time."""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import chain, compress, islice, zip_longest
from pathlib import Path

from attrs import frozen

from vedette.errors import InputError, Problem
from vedette_files.input_files import lines, shown
from vedette_files.tables.columnar import TablePath, header_and_rows, is_columnar
from vedette_files.tables.composed import cell_of, made_of, perhaps_of
from vedette_files.tables.numbers import COMMA, Row, is_number

WIDEST = 131_072
"""Characters of a cell; what Python's csv module reads unless it is told otherwise, for the whole process."""

BY_ROW = "row"
"""The `scan` of a table each of whose rows is a scan of its own."""

UNCLOSED = (
    f"a quotation mark is not closed in its line, or a cell has more than {WIDEST:,} characters:"
    " close it, delete it, or write each row in one line"
)

_SEPARATOR_LINE = re.compile(r'"?sep=.?"?', re.IGNORECASE)
"""What Excel writes above a header to say what stands between columns."""

BETWEEN = (",", ";", "\t", "|", " ")
"""What may stand between cells."""

TOP, FARTHEST = 100, 400
"""In so many lines a header is looked for, then in so many; `TOP` lines below one say whether it is."""

MOST_JOINED = 6
"""Titles stand in so many lines at most."""


@frozen
class Dialect:
    """How a file writes its rows: what stands between columns, and in decimal numbers."""

    delimiter: str = ","
    decimal: str = "."

    def cells(self, line: str) -> list[str] | None:
        """Return the cells of a line, with decimal points; None as `cells_of` does."""
        blank = self.delimiter == " "
        cells = cells_of(line.replace("\t", " ").lstrip("# ").rstrip() if blank else line, self.delimiter)
        if self.decimal == "." or cells is None:
            return cells
        return [COMMA.sub(r"\1.\2", cell) if COMMA.fullmatch(cell) else cell for cell in cells]


COMMAS = Dialect()
"""What most files are."""


def rows(path: TablePath, wanted: Mapping[str, str], place: str, dialect: Dialect, refused: list[Problem]) -> Iterator[Row]:
    """Yield the rows of a table without blank lines; rows of another length than the header's are added to `refused`.

    Anything may stand above the header, and empty cells beyond its last column.

    wanted: name in the config -> title of the column; `place` is the config's table that names them, for messages. Each
    line is a row by itself, so a stray quotation mark costs one row. InputError: no file, no rows, a header that lacks a
    column or has it twice.
    """
    if not isinstance(path, Path) or is_columnar(path):
        yield from _columnar(path, wanted, place)
        return
    numbers, first, given = header_line(lines(path))
    top = numbers[-1]
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
        raise InputError(f"{path}: has a header and no rows: write one below it for each return")


def _too_many(cells: Sequence[str], width: int) -> str:
    """Return what may be wrong with a row that has more cells than the header, each a whole number; or ""."""
    split = width < len(cells) <= 2 * width and all(cell.strip(" +-").isdigit() for cell in cells)
    return "; decimal commas between commas cannot be read: put semicolons between columns" if split else ""


def header_line(given: Iterator[tuple[int, str]]) -> tuple[range, str, Iterator[tuple[int, str]]]:
    """Return the numbers of the header's lines and its text, and the lines below it.

    It is the first line after which most have as many cells as it, and numbers where it has words; else the first one that
    is no comment. Titles that stand twice are joined with the words below them. The last comment, which begins with
    #, counts if numbers follow it: so numpy.savetxt writes a header.
    """
    looked_at = islice(given, FARTHEST)
    text = [(n, line) for n, line in looked_at if line.strip() and not _SEPARATOR_LINE.fullmatch(line.strip())]
    first = next((i for i, (_, line) in enumerate(text) if not line.lstrip().startswith("#")), len(text) - 1)
    if first > 0 and any(map(is_number, re.split(f"[{''.join(BETWEEN)}]", text[first][1].strip()))):
        first -= 1
    plain = [line for _, line in text[first:]]
    found = next(filter(None, ([*_headers(plain[:most])] for most in (TOP, FARTHEST))), [])
    _, at, last, titles = min(found, default=((), 0, 0, plain[0] if plain else ""))
    numbers = range(text[first + at][0], text[first + last][0] + 1) if text else range(1, 2)
    return numbers, titles, chain(text[first + last + 1 :], given)


def _headers(text: Sequence[str]) -> Iterator[tuple[tuple[bool, bool], int, int, str]]:
    """Yield what may be the header of the lines below it, the surer the less: its first and its last line, and its text."""
    for delimiter in BETWEEN:
        table = [Dialect(delimiter).cells(line) or [] for line in text]
        numeric = [[*map(_is_numeric, cells)] for cells in table]
        for i, line in enumerate(table):
            (last, titles), twice = _joined(table, i), len({*line}) < len(line)
            if _above_rows(line, table[i + 1 : i + 1 + TOP], numeric[i + 1 :]):
                yield (twice, False), i, i, text[i]
                if not twice:
                    break
            if last > i and _above_rows(titles, table[last + 1 : last + 1 + TOP], numeric[last + 1 :]):
                yield (len({*titles}) < len(titles), True), i, last, delimiter.join(f'"{title}"' for title in titles)


def _above_rows(titles: Sequence[str], below: Sequence[list[str]], numeric: Sequence[Sequence[bool]]) -> bool:
    """Return whether the line below, most of ten and most of all have as many cells as titles, and numbers below words."""
    fits = [len(fitted(cells, len(titles)) or []) == len(titles) > 1 for cells in below]
    if any(2 * sum(fits[:n]) <= len(fits[:n]) for n in (1, 10, TOP)):
        return False
    columns = zip(titles, *compress(numeric, fits), strict=False)
    over = [title for title, *column in columns if 2 * sum(column) > len(column)]
    return all(over) and 2 * sum(map(_is_numeric, over)) < len(over)


def _is_numeric(cell: str) -> bool:
    return is_number(cell.replace(",", "."))


def _joined(table: Sequence[Sequence[str]], first: int) -> tuple[int, list[str]]:
    """Return the last line of the header that begins at a line, and its titles, joined while one stands twice or is empty.

    An empty cell of a line above the last is the one before it; a line that is the same over all columns is left out.
    """
    last, titles = first, list(table[first])
    most = min(len(table), first + MOST_JOINED) - 1
    while ("" in titles or len(set(titles)) < len(titles)) and last < most and _worded(table[last + 1]):
        last += 1
        lines = [list(line) for line in table[first : last + 1] if len(set(line[1:])) > 1] or [list(table[last])]
        for line in lines[:-1]:
            line += [""] * (len(lines[-1]) - len(line))
            for i, cell in enumerate(lines[-1]):
                line[i] = line[i] or (line[i - 1] if i and cell else "")
        titles = [" ".join(filter(None, cells)) for cells in zip_longest(*lines, fillvalue="")]
        titles = titles[: len(titles) - next(i for i, title in enumerate(reversed(titles)) if title)]
    return last, titles


def _worded(line: Sequence[str]) -> bool:
    return any(line) and not any(cell[:1].isdigit() or is_number(cell) for cell in line)


def fitted(cells: list[str] | None, width: int) -> list[str] | None:
    """Return a row's cells without empty ones beyond the header's: some programs end a row with a delimiter."""
    return cells if cells is None or any(cells[width:]) else cells[:width]


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
        raise InputError(f"{path}: has a header and no rows: write one below it for each return")


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
    if '"' not in line and delimiter != " " and delimiter in line and len(line) <= WIDEST:  # what csv would return, sooner
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        return [cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))]
    except (csv.Error, StopIteration):
        return None
