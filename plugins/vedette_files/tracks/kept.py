"""The tracks that a service keeps: rows of a database of SQLite, by time and by place."""

from __future__ import annotations

import json
import sqlite3
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from vedette.errors import InputError
from vedette.space import Array, Space, SpaceError
from vedette.types import Track

MAGIC = b"SQLite format 3\x00"
"""Bytes that a database of SQLite begins with."""

SCHEMA = """
CREATE TABLE IF NOT EXISTS tracks (
    time REAL NOT NULL, id INTEGER NOT NULL, x REAL, y REAL, latitude REAL, longitude REAL,
    existence REAL NOT NULL, confirmed INTEGER NOT NULL, mean TEXT NOT NULL, cov TEXT NOT NULL,
    PRIMARY KEY (time, id)
);
CREATE INDEX IF NOT EXISTS tracks_by_id ON tracks (id, time);
CREATE INDEX IF NOT EXISTS tracks_by_place ON tracks (x, y);
CREATE TABLE IF NOT EXISTS facts (name TEXT PRIMARY KEY, value TEXT NOT NULL);
"""
_COLUMNS = "time, id, x, y, latitude, longitude, existence, confirmed, mean, cov"
_INSERT = f"INSERT OR REPLACE INTO tracks ({_COLUMNS}) VALUES (?,?,?,?,?,?,?,?,?,?)"


@frozen
class Wanted:
    """Which of the tracks are asked for: from and until a time in s, in a box (x from, y from, x to, y to) in m."""

    since: float | None = None
    until: float | None = None
    box: tuple[float, float, float, float] | None = None

    def where(self) -> tuple[str, list[float]]:
        """Return a condition of SQL, and its values."""
        parts, values = ["1"], list[float]()
        for limit, text in ((self.since, "time >= ?"), (self.until, "time <= ?")):
            if limit is not None:
                parts.append(text)
                values.append(limit)
        if self.box is not None:
            parts.append("x BETWEEN ? AND ? AND y BETWEEN ? AND ?")
            values += [self.box[0], self.box[2], self.box[1], self.box[3]]
        return " AND ".join(parts), values


def is_database(path: Path) -> bool:
    """Return whether a file is a database of SQLite."""
    try:
        with path.open("rb") as file:
            return file.read(len(MAGIC)) == MAGIC
    except OSError:
        return False


def keep_tracks(
    into: sqlite3.Connection, time: float, space: Space, columns: Mapping[str, Any], places: tuple[Array, Array] | None
) -> None:
    """Add the tracks at one time: `columns` has id, mean, cov, existence, confirmed; `places` latitudes and longitudes."""
    mean, count = columns["mean"], len(columns["id"])
    x, y = (mean[:, space.names.index(axis)].tolist() if axis in space else [None] * count for axis in ("x", "y"))
    north, east = ([None] * count, [None] * count) if places is None else (values.tolist() for values in places)
    numbers = columns["id"].tolist(), x, y, north, east, columns["existence"].tolist(), columns["confirmed"].tolist()
    states = mean.tolist(), columns["cov"].tolist()
    into.executemany(
        _INSERT,
        [(time, *row, json.dumps(m), json.dumps(p)) for *row, m, p in zip(*numbers, *states, strict=True)],
    )


def keep_facts(into: sqlite3.Connection, space: Space, notes: Mapping[str, str]) -> None:
    """Write what is the same of all tracks: their axes, and what notes say of the earth and of times."""
    axes = [[axis.name, axis.unit + (" mod 2pi" if axis.period else "")] for axis in space.axes]
    facts = {"axes": json.dumps(axes), "notes": json.dumps(dict(notes))}
    into.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?)", facts.items())


def read_kept(path: Path, wanted: Wanted) -> tuple[tuple[Track, ...], Space, dict[str, str]]:
    """Return the tracks of a database that are asked for, their space, and notes; InputError if it holds none."""
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=5.0)) as there:
            there.execute("PRAGMA trusted_schema = OFF")
            facts = dict(there.execute("SELECT name, value FROM facts").fetchall())
            condition, values = wanted.where()
            columns = "id, time, existence, confirmed, mean, cov"
            rows = there.execute(f"SELECT {columns} FROM tracks WHERE {condition} ORDER BY id, time", values).fetchall()
        space = Space.of(**dict(json.loads(facts["axes"])))
        return _tracks(rows, space), space, json.loads(facts["notes"])
    except (sqlite3.Error, SpaceError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: holds no tracks of a service: {type(error).__name__}: {error}") from None


def _tracks(rows: Iterable[tuple[Any, ...]], space: Space) -> tuple[Track, ...]:
    """Return the tracks of rows in the order of their ids."""
    by_id = defaultdict[int, list[tuple[Any, ...]]](list)
    for row in rows:
        by_id[row[0]].append(row)
    tracks = tuple(_track(number, own, space) for number, own in by_id.items())
    for track in tracks:
        if track.mean.shape[1:] != (len(space),) or track.cov.shape[1:] != (len(space), len(space)):
            raise ValueError(f"track {track.id}: has {track.mean.shape[1:]} and {track.cov.shape[1:]} over {space}")
    return tracks


def _track(number: int, rows: Sequence[tuple[Any, ...]], space: Space) -> Track:
    times, existence = (np.array([row[k] for row in rows], dtype=float) for k in (1, 2))
    mean, cov = (np.array([json.loads(row[k]) for row in rows], dtype=float) for k in (4, 5))
    unknown, none = np.full(len(rows), np.nan), np.ones(1)  # which returns they took is not kept
    return Track(
        number,
        space,
        times,
        mean,
        cov,
        np.array([bool(row[3]) for row in rows]),
        existence,
        None,
        tuple(none for _ in rows),
        unknown,
        unknown,
    )
