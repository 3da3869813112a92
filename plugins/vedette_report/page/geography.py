"""What lies under the map of a page: lines of a GeoJSON file, and a graticule, both in m around the recording's origin."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, InputError
from vedette_files import Origin
from vedette_files.json_values import read_table

MOST = 200_000
"""Points of an underlay: more would make the page slow."""

_DEGREE = 111_320.0
"""m of a degree on the equator, about: it only chooses which meridians and parallels to draw."""
_STEPS = (10.0, 5.0, 2.0, 1.0, 30 / 60, 20 / 60, 10 / 60, 5 / 60, 2 / 60, 1 / 60, 30 / 3600, 10 / 3600)
"""Distances in deg of the graticule's lines."""

Lines = list[dict[str, Any]]


def east_north(latitude: Array, longitude: Array, origin: Origin) -> Array:
    """Return east and north (s, 2) in m on the tangent plane of WGS 84 at `origin`, all angles in deg."""
    east, north, _ = origin.to_plane(latitude, longitude, origin.altitude)
    return np.stack([east, north], axis=-1)


def read_origin(text: str) -> Origin:
    """Return latitude and longitude in deg of a text as '63.43, 10.39'; ValueError says what is wrong."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise ValueError(f"must be a latitude and a longitude in deg, as in '63.43,10.39', got {text!r}") from None
    if not (abs(latitude) <= 90 and abs(longitude) <= 180):
        raise ValueError(f"must be a latitude in -90 to 90 and a longitude in -180 to 180, got {text!r}")
    return Origin(latitude, longitude)


def read_underlay(path: Path, origin: Origin | None) -> Lines:
    """Return the lines and the outlines of areas in a GeoJSON file: degrees around `origin`, or m on the map without one."""
    try:
        lines = [*_lines(read_table(path))]
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
        raise InputError(f"{path}: must be GeoJSON: {' '.join(str(error).split())}") from None
    if origin is not None:
        lines = [part for line in lines for part in _within_reach(line, origin)]
    count = sum(len(line["points"]) for line in lines)
    if count > MOST:
        raise InputError(f"{path}: has {count:,} points, and a page takes at most {MOST:,}: simplify it first")
    for line in lines:
        if origin is not None:
            longitude, latitude = line["points"].T
            line["points"] = east_north(latitude, longitude, origin)
        line["points"] = np.round(line["points"], 1).tolist()
    return lines


def _within_reach(line: dict[str, Any], origin: Origin) -> Lines:
    """Return the parts of a line that the plane around the origin reaches: farther away it folds over."""
    longitude, latitude = line["points"].T
    near = origin.reaches(latitude, longitude)
    if near.all():
        return [line]
    edges = np.flatnonzero(np.diff(near)) + 1
    parts = zip(np.split(line["points"], edges), np.split(near, edges), strict=True)
    return [{"points": points, "closed": False} for points, depths in parts if depths[0] and len(points) > 1]


def _lines(data: Any) -> Iterator[dict[str, Any]]:
    kind = data["type"]
    if kind == "FeatureCollection":
        for feature in data["features"]:
            yield from _lines(feature)
    elif kind == "Feature" and data["geometry"] is not None:
        yield from _lines(data["geometry"])
    elif kind == "GeometryCollection":
        for geometry in data["geometries"]:
            yield from _lines(geometry)
    elif kind == "LineString":
        yield _line(data["coordinates"], closed=False)
    elif kind in ("MultiLineString", "Polygon"):
        for polygon_of in data["coordinates"]:
            yield _line(polygon_of, closed=kind == "Polygon")
    elif kind == "MultiPolygon":
        for polygon in data["coordinates"]:
            for polygon_of in polygon:
                yield _line(polygon_of, closed=True)
    elif kind not in ("Feature", "Point", "MultiPoint"):
        raise ValueError(f"unknown type {kind!r}")


def _line(coordinates: Any, *, closed: bool) -> dict[str, Any]:
    points = np.array([point[:2] for point in coordinates], dtype=float).reshape(-1, 2)
    if not np.isfinite(points).all():
        raise ValueError("a coordinate is not finite")
    return {"points": points, "closed": closed}


def graticule(origin: Origin, low: Array, high: Array) -> Lines:
    """Return meridians and parallels that cross the box from `low` to `high` (2,) in m, each with its `label`."""
    narrow = max(float(np.cos(np.radians(origin.latitude))), 0.05)
    size = float(np.max(high - low)) / _DEGREE
    step = next((candidate for candidate in reversed(_STEPS) if size / candidate <= 6), _STEPS[0])
    north = origin.latitude + np.array([low[1], high[1]]) / _DEGREE + step * np.array([-1, 1])
    east = origin.longitude + np.array([low[0], high[0]]) / (_DEGREE * narrow) + step * np.array([-1, 1])
    along = np.linspace(0.0, 1.0, 30)
    lines: Lines = []
    for latitude in (step * np.arange(np.ceil(north[0] / step), np.floor(north[1] / step) + 1)).tolist():
        points = east_north(np.full(30, latitude), east[0] + along * (east[1] - east[0]), origin)
        lines.append({"label": _angle(latitude, "NS", step), "points": np.round(points, 1).tolist()})
    for longitude in (step * np.arange(np.ceil(east[0] / step), np.floor(east[1] / step) + 1)).tolist():
        points = east_north(north[0] + along * (north[1] - north[0]), np.full(30, longitude), origin)
        lines.append({"label": _angle(longitude, "EW", step), "points": np.round(points, 1).tolist()})
    return lines


def _angle(value: float, letters: str, step: float) -> str:
    """Return an angle in degrees, minutes and seconds, as fine as the step asks."""
    seconds = round(abs(value) * 3600)
    text = f"{seconds // 3600}°"
    if step < 1:
        text += f"{seconds // 60 % 60:02d}\N{PRIME}"
    if step < 1 / 60:
        text += f"{seconds % 60:02d}\N{DOUBLE PRIME}"
    return text + letters[value < 0]
