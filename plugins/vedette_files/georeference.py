"""Tracks in the terms of their recording: latitude, longitude and dates, where its notes say what x, y and times are."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from datetime import timedelta
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array, Space, Track
from vedette_files.codes import labels
from vedette_files.geodesy import Origin
from vedette_files.readers import NORTH_EAST, east_north
from vedette_files.tables.times import DATED, EPOCH
from vedette_files.writing import whole_file


@frozen
class Terms:
    """Where on the earth x and y are 0, whether x points north, whether times are s since 1970 in UTC, and whether returns
    name their objects.
    """

    origin: Origin | None = None
    north_east: bool = False
    dated: bool = False
    named: bool = False

    @classmethod
    def of(cls, notes: Mapping[str, str], tracks: Sequence[Track] = ()) -> Terms:
        """Return what a recording's notes state, or its tracks; an origin that cannot be read is none."""
        try:
            origin = Origin.of(notes["origin"]) if "origin" in notes else None
        except (TypeError, ValueError):
            origin = None
        named = NAMED in notes or any(track.identity is not None for track in tracks)
        return cls(origin, notes.get("frame") == NORTH_EAST, notes.get("time") == DATED, named)

    @property
    def ground(self) -> tuple[str, str]:
        """The axes that point east and north."""
        return east_north(NORTH_EAST if self.north_east else "")

    def stay(self, later: Terms) -> bool:
        """Return whether x and y of these terms are at the same places in later ones, which may tell an origin first."""
        return self.north_east == later.north_east and self.origin in (None, later.origin)

    def when(self, time: float) -> str:
        """Return a time in words: a date where times are dates.

        >>> Terms().when(12.5), Terms().when(1796018400.728)
        ('12.5 s', '1796018400.728 s')
        """
        return utc(time) if self.dated else f"{f'{time:.3f}'.rstrip('0').rstrip('.')} s"

    def columns(self, space: Space) -> tuple[str, ...]:
        """Return the titles of the columns that tracks over `space` have in these terms."""
        placed = self.origin is not None and "x" in space and "y" in space
        positions = ("latitude", "longitude", "altitude")[: 3 if "z" in space else 2] if placed else ()
        return (*(("identity",) if self.named else ()), *(("utc",) if self.dated else ()), *positions)

    def values(self, track: Track) -> dict[str, Any]:
        """Return a track's values (s,) by those titles: names, dates by ISO 8601, deg, m."""
        names = {"identity": labels(track.identity, len(track.times))} if self.named else {}
        return names | self.table(track.times, track.space, track.mean)

    def table(self, times: Array, space: Space, states: Array) -> dict[str, Any]:
        """Return the values of states (s, n) over `space` at `times` (s,)."""
        columns: dict[str, Any] = {"utc": [utc(time) for time in times.tolist()]} if self.dated else {}
        if self.origin is not None and "x" in space and "y" in space:
            at = dict(zip(space.names, states.T, strict=True))
            east, north = self.ground
            place = self.origin.from_plane(at[east], at[north], at.get("z"))
            columns |= dict(zip(("latitude", "longitude", "altitude"), place, strict=True))
        return {title: columns[title] for title in self.columns(space) if title != "identity"}


NAMED = "identity"
"""The note of a recording whose returns name their objects: by which column."""

PLAIN: Terms = Terms()
"""Of a recording that says nothing of the earth or the date."""


def utc(time: float) -> str:
    """Return the date and time of s since 1970 in UTC by ISO 8601, to the microsecond; "" beyond the years of a calendar."""
    try:
        return (EPOCH + timedelta(seconds=time)).isoformat().replace("+00:00", "Z")
    except (OverflowError, ValueError):
        return ""


def write_geojson(path: Path, tracks: Sequence[Track], terms: Terms) -> None:
    """Write a map of the tracks: a line each, from where it was first confirmed, with its number and its times.

    RFC 7946. Equal tracks give equal bytes. A number that is not finite leaves its point out.
    """
    write_features(path, [feature for track in tracks if (feature := _feature(track, terms)) is not None])


def write_features(path: Path, features: Sequence[dict[str, Any]]) -> None:
    """Write features as GeoJSON, a line each."""
    with whole_file(path) as file:
        file.write('{"type": "FeatureCollection", "features": [\n')
        file.write(",\n".join(json.dumps(feature, allow_nan=False) for feature in features))
        file.write("\n]}\n")


def _feature(track: Track, terms: Terms) -> dict[str, Any] | None:
    line, times = points_of(track, terms)
    if not line:
        return None
    return {"type": "Feature", "geometry": geometry(line), "properties": properties_of(track, times)}


def properties_of(track: Track, times: list[Any]) -> dict[str, Any]:
    """Return the properties of a track's line: its number, what it is named if that is known, and its times."""
    named = [] if track.identity is None else [name for name in labels(track.identity, len(track.times)) if name]
    return {"track": track.id} | ({"identity": named[-1]} if named else {}) | {"times": times}


def points_of(track: Track, terms: Terms, *, confirmed: bool = False) -> tuple[list[list[float]], list[Any]]:
    """Return longitudes, latitudes and altitudes of a track from where it was first confirmed on, and their times.

    `confirmed`: it was before these scans. A number that is not finite leaves its point out.
    """
    columns = terms.values(track)
    points = np.stack([columns[name] for name in ("longitude", "latitude", "altitude") if name in columns], axis=-1)
    shown = np.maximum.accumulate(track.confirmed) | confirmed
    chosen = np.flatnonzero(np.all(np.isfinite(points), axis=-1) & shown)
    times = [columns["utc"][i] for i in chosen] if terms.dated else track.times[chosen].tolist()
    return [[round(number, 9) for number in point] for point in points[chosen].tolist()], times


def geometry(line: list[list[float]]) -> dict[str, Any]:
    """Return a line as GeoJSON has it, a point where it has only one; several lines where it crosses 180 deg."""
    if len(line) == 1:
        return {"type": "Point", "coordinates": line[0]}
    cuts = [i for i in range(1, len(line)) if abs(line[i][0] - line[i - 1][0]) > 180.0]
    if not cuts:
        return {"type": "LineString", "coordinates": line}
    parts = [line[i:j] for i, j in pairwise([0, *cuts, len(line)])]
    return {"type": "MultiLineString", "coordinates": [part if len(part) > 1 else part * 2 for part in parts]}
