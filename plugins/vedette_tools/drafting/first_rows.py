"""The titles of a table and its first rows, by the text alone: what stands between cells, and what is no table."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import islice, pairwise
from pathlib import Path
from shlex import quote

from vedette.errors import InputError
from vedette_files.input_files import lines, shown
from vedette_files.tables.columnar import TablePath, header_and_rows, is_columnar
from vedette_files.tables.numbers import is_number
from vedette_files.tables.rows import BETWEEN, COMMAS, Dialect, fitted, header_line
from vedette_tools.drafting.dates import is_day, is_plain_clock, is_plain_day
from vedette_tools.drafting.measures import in_degrees
from vedette_tools.drafting.several import HELD, is_angle
from vedette_tools.drafting.titles import UNITS, meaning

LOOKED_AT = 2000
"""So many rows say what the columns hold."""

NO_LINE = "no line above the rows has a title for each of their cells: make a table of them first, as time,x,y"

ONE_EACH = "titles in several lines, or for several columns, are not read: write a line with one for each, as time,x,y"

HEARD = "which tells who heard a tag, and no positions: track those that a positioning service makes of it, as time,id,x,y"

FAMILIAR = {
    ("receiver", "transmitter"): f"a table of VEMCO's, {HEARD}",
    ("local number", "message", "field 1"): "records of FIT as FitCSVTool prints them: with --data record it writes a table "
    "with a column for each field, too, or gpsbabel -i garmin_fit makes GPX",
    ("vehicle_id", "local_x", "local_y"): "trajectories of NGSIM, in feet and ms: keep the rows of one Location, and say "
    "--time Global_Time --columns x=Local_X,y=Local_Y --units time=ms,x=ft,y=ft",
}
"""Titles of tables that many have, in small letters, and what to do with such a table."""

NO_ROWS = {
    re.compile(
        r"(^|\\|[\]\s])[!$][A-Z]{5},"
    ): "sentences of NMEA 0183, not a table: decode them to one first, let `vedette serve` "
    "read them, or, if TAG blocks tell times, the source `stream`; or let gpsbabel make GPX of a receiver's own positions",
    re.compile(r"^B\d{13}[NS]\d{8}[EW][AV]"): "fixes of a logger by IGC, not a table: `gpsbabel -i igc -f FILE -o gpx -F "
    "FILE.gpx` makes GPX of them, which is read",
    re.compile(r"^\s*((Asterix\.)?CAT\d{3}|Category\s*[:=] *\d+|(Item\s*)?I\d{3}(/\d{3})?\s*:)[^,;]*$", re.IGNORECASE): (
        "ASTERIX as a decoder prints it for people: have it print JSON, or let the source `stream` or `vedette serve` read "
        "the bytes themselves, format = { kind = 'asterix' }"
    ),
    re.compile(
        r"^[A-Z0-9-]{3,9}>[A-Z0-9]+[A-Za-z0-9,*-]*:"
    ): "packets of APRS, as OGN sends them, not a table: decode them to one first, as time,id,lat,lon",
    re.compile(r"^VEMCO DATA LOG,"): f"a log of VEMCO's, {HEARD}",
    re.compile(
        r"^#[a-d][PV] ?\d{4}\s"
    ): "orbits of SP3, from the middle of the earth, a line of the time above each moment: make "
    "a table of them first, with latitudes and longitudes, as time,id,lat,lon,altitude",
    re.compile(
        r"(^|[*,;\s\"])(?=\d*[A-Fa-f])[0-9A-Fa-f]{28}([;,\s\"]|$)"
    ): "messages of Mode S as they were sent: decode them to a "
    "table first, as time,icao24,lat,lon, which dump1090 or pyModeS do",
    re.compile(r"^1 \d{5}[A-Z] \d{5}[A-Z ]"): "elements of orbits (TLE), not positions: work out those of each moment first",
}
"""Lines of what is no table, and what to do with it."""

LIST = re.compile(r"\[.*,.*\]")
"""A cell that holds a list."""

IN_A_LINE = "holds several positions between semicolons: write a row for each, as time,id,x,y"

HEMISPHERES = {"N": "latitude", "S": "latitude", "E": "longitude", "W": "longitude"}
"""What an angle is that ends in such a letter."""

MOST_HEADERS = 3
"""Lines below the header, as TrackMate's, of which one may hold units."""


def dialect_of(path: TablePath) -> Dialect:
    """Return how a table is written; InputError if its first line is no header."""
    return first_rows(path)[2]


def first_rows(path: TablePath) -> tuple[list[str], list[list[str]], Dialect, range]:
    """Return the titles, the first rows, how they are written, and the numbers of the lines with the titles."""
    if not isinstance(path, Path) or is_columnar(path):
        titles, _ = header_and_rows(path, ())
        titles, given = header_and_rows(path, titles)
        return titles, list(islice(given, LOOKED_AT)), COMMAS, range(1, 2)
    numbers, first, below = header_line(lines(path))
    number = numbers[0]
    if "\0" in first or first[:1] == "\ufffd":
        in_pairs = 2 * first.count("\0") >= len(first) - 1
        wanted = "a table is CSV, in UTF-8 or UTF-16, or Parquet; the source `video` reads frames"
        unmarked = "looks like UTF-16 without a byte order mark: save the table in UTF-8"
        raise InputError(f"{path}: {unmarked if in_pairs else f'is no text; {wanted}'}")
    numbered = [(each, line) for each, line in islice(below, LOOKED_AT) if line.strip()]
    text = [line for _, line in numbered]
    start = next(lines(path))[1]
    for each, line in [(1, start), (number, first), *numbered]:
        for lines_of, told in NO_ROWS.items():
            if lines_of.search(line):
                raise InputError(f"{path}:{each}: holds {told}")
    if any(sum(part.count(",") > 1 for part in line.split(";")) > 3 for line in (first, *text)):
        raise InputError(f"{path}:{number}: {IN_A_LINE}")
    if start.lstrip().startswith("<?xml") or first.lstrip().startswith("<"):
        cure = "XML is read as GPX alone, from a file named .gpx: gpsbabel makes it of KML and TCX; save others as CSV"
        raise InputError(f"{path}:1: must be the titles of the columns, got {shown(start)}; {cure}")
    delimiter = max(BETWEEN[:-1], key=first.count)
    delimiter = delimiter if delimiter in first or len(first.split()) < 2 else " "
    dialect = Dialect(delimiter, _decimal(text, delimiter))
    header = dialect.cells(first)
    if not first.strip():
        raise InputError(f"{path}: holds blank lines only, and must begin with the titles of the columns, as time,x,y")
    if not header or _is_row(header):
        raise InputError(f"{path}:{number}: {_no_titles(path, number, [first, *text], delimiter)}")
    at, between_cells = _first_of_most(header, text)
    rows = [cells for line in text if (cells := fitted(dialect.cells(line), len(header))) and len(cells) == len(header)]
    named = not first.startswith("#") and any(meaning(cell).axis for cell in header)
    unfit = len(header) == 1 or (len(rows) < HELD * len(text) and not named)
    if at is not None and unfit:
        of_row = _is_row(Dialect(between_cells).cells(text[at]) or [])
        words = sum(not any(map(str.isdigit, cell)) for cell in Dialect(between_cells).cells(text[at]) or [])
        titled = ONE_EACH if 2 * words > len(Dialect(between_cells).cells(text[at]) or []) else NO_LINE
        told = _no_titles(path, numbered[at][0], text[at:], between_cells) if of_row else titled
        raise InputError(f"{path}:{numbered[at][0]}: {told}")
    if len(header) == 1:
        between = "a comma, a semicolon, a tab, | or blanks"
        raise InputError(
            f"{path}:{number}: must be the titles of the columns with {between} between them, got {shown(first)}"
        )
    return header, rows, dialect, numbers


def _first_of_most(header: Sequence[str], text: Sequence[str]) -> tuple[int | None, str]:
    """Return the first line that has as many cells as most, and what stands between these, if the first line has others."""
    for delimiter in BETWEEN:
        cells = [Dialect(delimiter).cells(line) or [] for line in text]
        width, often = Counter(map(len, cells)).most_common(1)[0] if cells else (0, 0)
        if width > 1 and width != len(header) and often >= HELD * len(cells):
            there = [i for i, row in enumerate(cells) if len(row) == width]
            return next((i for i in there if _is_row(cells[i])), there[0]), delimiter
    return None, ","


def _is_row(cells: list[str]) -> bool:
    """Return whether cells are a row of returns, no titles: at least half of them are numbers."""
    numbers = sum(map(is_number, cells))
    return numbers > 0 and 2 * (numbers + cells.count("")) >= len(cells)


def _no_titles(path: object, number: int, text: Sequence[str], delimiter: str) -> str:
    """Say that rows have no titles above them, and what to type."""
    wanted = f"must be a header line with the titles of the columns, as time,x,y; got {shown(text[0])}"
    table = [Dialect(delimiter).cells(line) or [] for line in text]
    width = Counter(map(len, table)).most_common(1)[0][0]
    rows, heads = [row for row in table if len(row) == width], [row for row in table if len(row) != width]
    if not width or "{" in text[0]:
        return f"{wanted}; make a table of it first, or JSON lines, each with its time"
    if 2 * len(heads) >= len(table):
        return f"{wanted}; rows of other kinds have other numbers of columns: put those of each into a file of its own"
    named: list[str] = []
    for cell, before in zip(rows[0], ["", *rows[0]], strict=False):
        of_angle = HEMISPHERES.get(cell[-1:], "") if is_angle(cell) else ""
        is_clock = ":" in cell or (is_plain_day(before) and is_plain_clock(cell))
        name = "time" if is_clock else "date" if is_day(cell) or is_plain_day(cell) else of_angle
        named.append(f"c{len(named) + 1}" if not name or name in named else name)
    columns = list(zip(*rows, strict=True))
    for i, (first, second) in enumerate(pairwise(columns)):
        if in_degrees(second, first):
            named[i : i + 2] = ["latitude", "longitude"]
            break
    file = quote(str(path))
    rest = f"tail -n +{number} {file}"
    above = next(i for i, row in enumerate(table) if len(row) == width)
    if 0 < above == len(heads):
        rest = f"awk -F'{delimiter}' 'NF == {width}' {file}"  # what stands above the rows names no objects
    elif table[0] in heads and all(1 < len(row) < width for row in heads) and delimiter != " ":
        named.insert(0, "id")  # a line above the rows of each object names it
        rest = f"awk -F'{delimiter}' 'NF < {width} {{id = $1; next}} {{print id FS $0}}' {file}"
    return (
        f"{wanted}; write one above it, with the columns' own names: (echo '{delimiter.join(named)}'; {rest}) > titled.csv"
    )


def of_header(path: TablePath, titles: Sequence[str], below: Sequence[str]) -> str:
    """Return what is wrong with a header, by what stands below it, or ""."""
    in_lines = isinstance(path, Path) and not is_columnar(path)
    if in_lines and ("" in titles[:-1] or (any(below) and not any(sign.isdigit() for cell in below for sign in cell))):
        return f"; {ONE_EACH}"
    if of_lists := next((title for title, cell in zip(titles, below, strict=False) if LIST.fullmatch(cell)), ""):
        return f"; {of_lists} holds lists: write a row for each position in them, with its time"
    if "sample_token" in titles:
        return "; nuScenes keeps it in sample.json: join the two by sample_token"
    return ""


def familiar(titles: Sequence[str]) -> str:
    """Return what to do with a table that many have, by its titles, or ""."""
    small = {title.lower() for title in titles}
    return next((told for known, told in FAMILIAR.items() if small.issuperset(known)), "")


def units_of(path: TablePath, given: tuple[list[str], list[list[str]], Dialect, range]) -> tuple[list[str], str]:
    """Return the cells of the line that states units, and what is said of it; [] and "" without one.

    given: the titles, the first rows and what else is known of them. It may stand below the titles, after as many lines as
    hold no number or date, which are taken from the rows; or right above them.
    """
    titles, rows, dialect, numbers = given
    for i, row in enumerate(rows[:MOST_HEADERS]):
        if any(cell[:1].isdigit() or is_number(cell) for cell in row):
            break
        if any(map(_is_unit, row)):
            del rows[: i + 1]
            return row, "the row below the header states units; as a return it is refused"
    if not isinstance(path, Path) or is_columnar(path) or numbers[0] == 1:
        return [], ""
    *_, (_, above) = islice(lines(path), numbers[0] - 1)
    cells = fitted(dialect.cells(above.removeprefix("#")), len(titles)) or []
    units = sum(_is_unit(cell.partition(" ")[0]) for cell in cells)  # ft Baro
    told = len(cells) == len(titles) and not any(map(is_number, cells)) and units > 1
    return (cells, f"line {numbers[0] - 1}, above the titles, states units") if told else ([], "")


def _is_unit(cell: str) -> bool:
    return any(cell.strip("[]() ").lower() in known for known in UNITS.values())


def _decimal(text: Sequence[str], delimiter: str) -> str:
    """Return what numbers have before their decimals: the comma where more cells become numbers with it."""
    point, comma = (
        sum(is_number(cell) for line in text for cell in Dialect(delimiter, each).cells(line) or ()) for each in ".,"
    )
    return "," if comma > point else "."
