"""AIS reports from CSV: Time, MMSI, Latitude_degrees, Longitude_degrees, COG_degrees, SOG_knots."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from vedette import Problem
from vedette.fields import ABSURD
from vedette_files.input_files import lines, shown
from vedette_files.tables.rows import UNCLOSED, cells_of, header_of
from vedette_marine.ais.reports import KNOT, Reports, by_ship, turn_rate

WANTED = ("Time", "MMSI", "Latitude_degrees", "Longitude_degrees", "COG_degrees", "SOG_knots")
FURTHER = ("Heading_degrees", "ROT")


def read_csv(path: Path) -> tuple[dict[int, Reports], list[Problem]]:
    """Return the reports by MMSI, and the rows that could not be used.

    Times are in s, or date and time in UTC. An empty cell, a course of 360, a speed of 102.3 knots and a heading of 511 mean
    "not available" and become NaN; a row without latitude, longitude, time or MMSI is refused. InputError without a file.
    """
    given = lines(path)
    header = header_of(path, next(given)[1], WANTED, FURTHER)
    rows, refused = [], []
    for number, line in given:
        if not line.strip():
            continue
        place = f"{path.name}:{number}"
        cells = cells_of(line)
        if cells is None:
            refused.append(Problem(place, UNCLOSED))
            continue
        if len(cells) != len(header):
            refused.append(Problem(place, f"must have {len(header)} columns as in the header, got {len(cells)}"))
            continue
        try:
            rows.append(_row(dict(zip(header, cells, strict=True))))
        except ValueError as error:
            refused.append(Problem(place, str(error)))
    return by_ship(rows), refused


def _row(cells: dict[str, str]) -> dict[str, float]:
    mmsi = _number(cells, "MMSI", 0.0, 999_999_999.0)
    if mmsi != int(mmsi):
        raise ValueError(f"MMSI must be a whole number, got {shown(cells['MMSI'])}")
    course = _maybe(cells, "COG_degrees", 0.0, 360.0)
    speed = _maybe(cells, "SOG_knots", 0.0, 102.3)
    heading = _maybe(cells, "Heading_degrees", 0.0, 511.0)
    return {
        "mmsi": mmsi,
        "time": _time(cells["Time"]),
        "latitude": _number(cells, "Latitude_degrees", -90.0, 90.0),
        "longitude": _number(cells, "Longitude_degrees", -180.0, 180.0),
        "speed": np.nan if speed > 102.25 else speed * KNOT,
        "course": np.nan if course >= 360.0 else np.deg2rad(course),
        "heading": np.nan if heading >= 360.0 else np.deg2rad(heading),
        "turn": float(turn_rate(np.array(_maybe(cells, "ROT", -128.0, 127.0)))),
    }


def _number(cells: dict[str, str], name: str, low: float, high: float) -> float:
    try:
        value = float(cells[name])
    except ValueError:
        raise ValueError(f"{name} must be a number, got {shown(cells[name])}") from None
    if not low <= value <= high:
        raise ValueError(f"{name} must be from {low:g} to {high:g}, got {shown(cells[name])}")
    return value


def _maybe(cells: dict[str, str], name: str, low: float, high: float) -> float:
    return _number(cells, name, low, high) if cells.get(name) else np.nan


def _time(cell: str) -> float:
    try:
        seconds = float(cell)
    except ValueError:
        return _date(cell)
    if not abs(seconds) <= ABSURD:  # also for NaN
        raise ValueError(f"Time must be a finite number of at most {ABSURD:g} s, got {shown(cell)}")
    return seconds


def _date(cell: str) -> float:
    try:
        stamp = datetime.fromisoformat(cell)
    except ValueError:
        raise ValueError(f"Time must be in s or a date and time as 2016-01-12 13:02:11.218, got {shown(cell)}") from None
    return (stamp if stamp.tzinfo else stamp.replace(tzinfo=UTC)).timestamp()
