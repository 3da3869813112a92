"""Tables as records: JSON lines, a JSON list of records, the points of a GPX file; read as the cells of a CSV file are."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import chain, islice
from pathlib import Path
from shlex import quote
from typing import Any
from xml.etree.ElementTree import ParseError, iterparse

from vedette.errors import InputError
from vedette_files.input_files import check_regular, lines, shown, whole_text
from vedette_files.json_values import parse

LINES, WHOLE, GPX = (".jsonl", ".ndjson"), (".json", ".geojson"), ".gpx"
"""How the names of such files end."""

SUFFIXES = (*LINES, *WHOLE, GPX)

LOOKED_AT = 2000
"""The titles are those of so many records; what only later ones hold is not read."""

DEEPEST = 4
"""Records within records are opened so far."""

FORMAT = "vedette"
"""What the header of a recording in Vedette's own format says of itself."""

VERSION = re.compile("_?((?:smooth|filter|interpolat|correct|estimat)(?:ed)?|raw)_?", re.IGNORECASE)
"""Words of names of lists that tell the same things once more: players_smoothed beside players."""

TIMES, MANY = re.compile(".*time(stamp)?(ms|s)?|t", re.IGNORECASE), 8
"""A list of so many numbers under such a name holds the times of a track; a shorter one may be a date or a vector."""

PLACE = re.compile("lat|lon|[xy]$", re.IGNORECASE)
"""How names of parts of a position begin."""

POINT = ("time", "latitude", "longitude", "altitude", "track_id")
"""The columns of a GPX file."""


def header_and_records(path: Path) -> tuple[list[str], Iterator[Mapping[str, Any]]]:
    """Return the titles of a file of records, and its records, as flat tables; InputError if it cannot be read.

    A record within a record gives titles as `position.x`, a list of numbers `position.0`; each record of its lists, as of
    the detections of a frame, or else each list of numbers in a list gives a row, and so does each time of a list of times,
    with what stands there in the other lists. Of lists named alike but for a word as `smoothed`, titles of all but the first
    begin with that word.
    """
    if path.suffix.lower() == GPX:
        return list(POINT), _points(path)
    given = _of_lines(path) if path.suffix.lower() in LINES or _in_lines(path) else _of_list(path)
    flat = (row for place, record in given for row in _flat(place, record))
    first = list(islice(flat, LOOKED_AT))
    titles = dict.fromkeys(title for row in first for title in row)
    if not titles:
        raise InputError(f'{path}: holds no record, as {{ "t": 0.0, "x": 1.0, "y": 2.0 }}')
    return list(titles), chain(first, flat)


def _of_lines(path: Path) -> Iterator[tuple[str, Any]]:
    for number, line in lines(path):
        if line.strip():
            yield f"{path}:{number}", _parsed(f"{path}:{number}", line)


def _in_lines(path: Path) -> bool:
    """Return whether the first two lines of a file are a record each, whatever its name says."""
    first = islice((line for _, line in lines(path) if line.strip()), 2)
    try:
        records = [parse(line) if line.lstrip().startswith("{") else None for line in first]
    except (ValueError, RecursionError):
        return False
    return len(records) == 2 and all(isinstance(record, Mapping) for record in records)


def _of_list(path: Path) -> Iterator[tuple[str, Any]]:
    data = _parsed(str(path), whole_text(path))
    if isinstance(data, Mapping):  # columns, or a list below a name, as in { "now": 0.0, "detections": [...] }
        data = _of_columns(data)
    if isinstance(data, Mapping) and _times_in(data):
        data = [data]
    if isinstance(data, Mapping):
        lists = [name for name in data if _holds_rows(data[name])]
        if len(lists) == 1 or (not lists and [] in data.values()):
            data = [{**data, name: [part]} for name in lists for whole in data[name] for part in _apart(whole)]
    if not isinstance(data, list):
        told = f'must be a list of records, as [{{ "t": 0.0, "x": 1.0, "y": 2.0 }}], or hold one{_of_several(path, data)}'
        raise InputError(f"{path}: {told}")
    yield from ((f"{path}: record {number}", part) for number, record in enumerate(data, 1) for part in _apart(record))


def _of_several(path: Path, data: Any) -> str:
    """Say which lists of records a file holds, and how to take one of them, or return ""."""
    if not isinstance(data, Mapping):
        return ""
    found = {name: len(value) for name, value in data.items() if _holds_rows(value)}
    chosen = {name: f".{json.dumps(name)}" for name in found}
    for name, value in data.items():
        if isinstance(value, Mapping) and value and all(map(_holds_rows, value.values())):
            found[name], chosen[name] = sum(map(len, value.values())), f"[.{json.dumps(name)}[][]]"
    if not found:
        return ""
    there = ", ".join(f"{name} with {count:,}" for name, count in found.items())
    longest = max(found, key=lambda name: found[name])
    command = f"jq {quote(chosen[longest])} {quote(str(path))} > one.json"
    return f"; it holds {there}: take the one with times and positions, as by {command}"


def _apart(record: Any) -> Iterator[Any]:
    """Yield a record for each of the times that one holds in a list, with what its other lists of that length hold there.

    Lists of another length leave a title that says so, in brackets: it names no axis. Its cells are empty.
    """
    length = _times_in(record)
    yield from (_part(record, length, i) for i in range(length)) if length else (record,)


def _times_in(record: Any) -> int:
    """Return how many times stand in a list of a record, or in a record within it, as of a line in GeoJSON; 0 without."""
    if not isinstance(record, Mapping):
        return 0
    here = (len(value) for name, value in record.items() if isinstance(value, list) and TIMES.fullmatch(name))
    return next((length for length in here if length >= MANY), 0) or next(filter(None, map(_times_in, record.values())), 0)


def _part(value: Any, length: int, i: int) -> Any:
    if isinstance(value, Mapping):
        parts: dict[str, Any] = {}
        for name, inner in value.items():
            if isinstance(inner, list) and len(inner) != length:
                parts[f"({name}: {len(inner)} for {length} times)"] = None
            else:
                parts[name] = _part(inner, length, i)
        return parts
    return value[i] if isinstance(value, list) else value


def _of_columns(data: Mapping[str, Any]) -> Any:
    """Return the records of columns by name, as pandas writes them, or a list of rows below their titles; else the data."""
    titles, rows = data.get("columns"), data.get("data")
    if isinstance(titles, list) and isinstance(rows, list) and all(isinstance(row, list) for row in rows):
        return [dict(zip(map(str, titles), row, strict=False)) for row in rows]
    columns = [list(each.values()) if isinstance(each, Mapping) else each for each in data.values()]
    if len(columns) < 2 or not all(isinstance(each, list) and len(each) == len(columns[0]) > 1 for each in columns):
        return data
    return [dict(zip(data, row, strict=True)) for row in zip(*columns, strict=True)]


def _holds_rows(value: Any, of: tuple[type, ...] = (Mapping, list)) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(part, of) for part in value)


def _parsed(place: str, text: str) -> Any:
    try:
        return parse(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f'{place}: must be a record in JSON, as {{ "t": 0.0, "x": 1.0 }}: {error}') from None


def _flat(place: str, record: Any, depth: int = 0, points: bool = True) -> Iterator[dict[str, Any]]:
    """Yield the rows of a record; lists of numbers give rows only with `points`, and where no list of records does."""
    if not isinstance(record, Mapping):
        cure = '; a list of lists needs titles: {"columns": [...], "data": [...]}' if isinstance(record, list) else ""
        raise InputError(f'{place}: must be a record, as {{ "t": 0.0, "x": 1.0 }}, got {shown(str(record))}{cure}')
    if depth == 0 and record.get("format") == FORMAT:
        raise InputError(f"{place}: is a recording in Vedette's own format: a source of kind 'jsonl' reads it")
    row: dict[str, Any] = {}
    rows: list[dict[str, Any]] = []
    spots: list[dict[str, Any]] = []
    for name, value in record.items():
        if isinstance(value, Mapping) and depth < DEEPEST:
            first, *more = (
                {f"{name}.{title}": part for title, part in inner.items()} for inner in _flat(place, value, depth + 1, False)
            )
            row, rows = (row, [*rows, first, *more]) if more else (row | first, rows)
        elif _holds_rows(value, (Mapping,)) and _tells_of(record, value):
            row[f"({name}: each with a time of its own)"] = None
        elif _holds_rows(value, (Mapping,)) and depth < DEEPEST:
            again = _again(name, tuple(record))
            parts = (inner for part in value for inner in _flat(place, part, depth + 1))
            rows += [{f"{again}{title}": cell for title, cell in inner.items()} for inner in parts] if again else parts
        elif points and _holds_rows(value, (list,)):
            spots = [{f"{name}.{i}": number for i, number in enumerate(part)} for part in value]
        elif _holds_rows(value, (list,)):
            row[f"({name}: lists without times)"] = None
        elif isinstance(value, list):
            row |= {f"{name}.{i}": part for i, part in enumerate(value) if not isinstance(part, list | Mapping)}
        else:
            row[name] = value
    yield from ({**row, **inner} for inner in rows or spots or [{}])


def _tells_of(record: Mapping[str, Any], parts: list[Mapping[str, Any]]) -> bool:
    """Return whether records in a list, with a time as the record has, tell of it alone: it has a place of its own.

    So do the stations that heard a stroke of lightning, and what a phone took its owner to be doing.
    """
    times = [name for name in record if TIMES.fullmatch(name)]
    return any(map(PLACE.match, record)) and any(time in part for time in times for part in parts)


@lru_cache
def _again(name: str, names: tuple[str, ...]) -> str:
    """Return what begins the titles of a list that tells again what another of these names does, the shortest; or ""."""
    told = VERSION.sub("", name).lower()
    first = min((each for each in names if VERSION.sub("", each).lower() == told), key=len)
    again = VERSION.search(name)
    return f"{again[1].lower()}." if again and first != name else ""


def _points(path: Path) -> Iterator[dict[str, Any]]:
    """Yield the points of a GPX file's tracks and routes, with the number of each; without these, its waypoints."""
    check_regular(path)
    track, empty = 0, True
    marks: list[dict[str, Any]] = []
    try:
        with path.open("rb") as file:
            for event, element in iterparse(file, events=("start", "end")):
                tag = element.tag.rpartition("}")[2]
                if event == "start":
                    track += tag in ("trk", "rte")
                elif tag in ("trkpt", "rtept", "wpt"):
                    inner = {child.tag.rpartition("}")[2]: (child.text or "").strip() for child in element}
                    values = inner.get("time"), element.get("lat"), element.get("lon"), inner.get("ele"), str(track)
                    point = dict(zip(POINT, values, strict=True))
                    element.clear()
                    if tag == "wpt":
                        marks.append(point)
                    else:
                        empty = False
                        yield point
    except (ParseError, OSError) as error:
        raise InputError(f"{path}: cannot be read as GPX: {error}; if it is cut short, export it again") from None
    if empty:
        yield from marks
    if empty and not marks:
        raise InputError(f"{path}: holds no point with a latitude and a longitude, as <trkpt lat=... lon=...>")
