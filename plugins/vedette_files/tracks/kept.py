"""The tracks that a service keeps: rows of a database of SQLite, by time and by place."""

from __future__ import annotations

import json
import sqlite3
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import Array, InputError, Space, SpaceError, Track
from vedette_files.georeference import Terms

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
UNTIL = " until "
"""In the name of a fact, "axes until 7": that of the tracks with ids up to the number, and above that of the one before."""
_COLUMNS = "time, id, x, y, latitude, longitude, existence, confirmed, mean, cov"
_INSERT = f"INSERT OR REPLACE INTO tracks ({_COLUMNS}) VALUES (?,?,?,?,?,?,?,?,?,?)"


@frozen(eq=False)
class Kept:
    """Tracks that a service kept, over one space, and what notes say of them; `told`: what is not as it was kept, or ""."""

    tracks: tuple[Track, ...]
    space: Space
    notes: dict[str, str]
    told: str = ""


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
    """Write what is the same of all tracks from now on, before these: their axes, and what notes say of the earth and times.

    Axes that change, and notes by which x and y are elsewhere, stay those of the tracks so far: later ones have higher ids.
    """
    axes = json.dumps([[axis.name, axis.unit + (" mod 2pi" if axis.period else "")] for axis in space.axes])
    facts, before = {"axes": axes, "notes": json.dumps(dict(notes))}, dict(into.execute("SELECT name, value FROM facts"))
    (last,) = into.execute("SELECT MAX(id) FROM tracks").fetchone()
    if last is not None and before.get("axes", axes) != axes:
        facts[f"axes{UNTIL}{last}"] = before["axes"]
    if last is not None and not Terms.of(json.loads(before.get("notes", "{}"))).stay(Terms.of(notes)):
        facts[f"notes{UNTIL}{last}"] = before["notes"]
    into.executemany("INSERT OR REPLACE INTO facts VALUES (?, ?)", facts.items())


def read_kept(path: Path, wanted: Wanted) -> Kept:
    """Return the tracks of a database that are asked for, by the axes that all of them have; InputError if it holds none.

    Where x and y of some are elsewhere, those before are left out, and told.
    """
    try:
        with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=5.0)) as there:
            there.execute("PRAGMA trusted_schema = OFF")
            facts = dict(there.execute("SELECT name, value FROM facts").fetchall())
            condition, values = wanted.where()
            columns = "id, time, existence, confirmed, mean, cov"
            rows = there.execute(f"SELECT {columns} FROM tracks WHERE {condition} ORDER BY id, time", values).fetchall()
        now = Space.of(**dict(json.loads(facts["axes"])))
        before = [(last, Space.of(**dict(axes))) for last, axes in _before(facts, "axes")]
        tracks, told = _tracks(rows, now, before)
        tracks, notes = _of_one_place(tracks, facts, told)
        spaces = {str(track.space): track.space for track in tracks} or {str(now): now}
        *others, latest = spaces.values()
        common = Space(tuple(axis for axis in latest.axes if all(axis in other.axes for other in others)))
        if others:
            told.append(f"the tracks are over {' and over '.join(map(str, spaces))}: {common} is what all have")
        if not len(common):
            raise ValueError("; ".join([*told, "nothing: choose some of them by their times"]))
        shared = tuple(_over(track, common) for track in tracks)
        return Kept(shared, common, notes, "; ".join(told))
    except (sqlite3.Error, SpaceError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: holds no tracks of a service: {type(error).__name__}: {error}") from None


def _before(facts: Mapping[str, str], name: str) -> list[tuple[int, Any]]:
    """Return what a fact was, each time up to an id, in the order of these."""
    begin = f"{name}{UNTIL}"
    return sorted((int(key.removeprefix(begin)), json.loads(facts[key])) for key in facts if key.startswith(begin))


def _of_one_place(
    tracks: tuple[Track, ...], facts: Mapping[str, str], told: list[str]
) -> tuple[tuple[Track, ...], dict[str, str]]:
    """Return the tracks whose x and y are where those of the latest are, and its notes; add to `told` what is left out."""
    latest, first, notes = max((track.id for track in tracks), default=-1), -1, json.loads(facts["notes"])
    for last, before in _before(facts, "notes"):
        if latest <= last:
            notes = before
            break
        first = last
    kept = tuple(track for track in tracks if track.id > first)
    if left_out := [track for track in tracks if track.id <= first]:
        until = max(float(track.times[-1]) for track in left_out)
        told.append(f"{len(left_out)} tracks are of another origin or frame, and are left out: --until {until!r} has them")
    return kept, notes


def _tracks(
    rows: Sequence[tuple[Any, ...]], now: Space, before: Sequence[tuple[int, Space]]
) -> tuple[tuple[Track, ...], list[str]]:
    """Return the tracks of rows in the order of their ids, and what is told of rows that are left out.

    An older Vedette did not keep which axes tracks had before these changed: rows of another number of axes are left out.
    """
    by_id = defaultdict[int, list[tuple[Any, ...]]](list)
    spaces, left_out = dict[int, Space](), 0
    for number, *row, mean, cov in rows:
        space = spaces.setdefault(number, next((of for last, of in before if number <= last), now))
        one = (number, *row, np.array(json.loads(mean), dtype=float), np.array(json.loads(cov), dtype=float))
        if one[4].shape == (len(space),) and one[5].shape == (len(space), len(space)):
            by_id[number].append(one)
        else:
            left_out += 1
    if left_out == len(rows) > 0:
        raise ValueError(f"none of its {left_out} estimates is over {now}")
    told = [f"{left_out} estimates are over other axes, which are not known, and are left out"] if left_out else []
    return tuple(_track(number, own, spaces[number]) for number, own in by_id.items()), told


def _over(track: Track, space: Space) -> Track:
    """Return a track over some of its axes."""
    at = track.space.locate(space)
    return evolve(track, space=space, mean=track.mean[:, at], cov=track.cov[:, at][:, :, at])


def _track(number: int, rows: Sequence[tuple[Any, ...]], space: Space) -> Track:
    times, existence = (np.array([row[k] for row in rows], dtype=float) for k in (1, 2))
    mean, cov = (np.stack([row[k] for row in rows]) for k in (4, 5))
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
