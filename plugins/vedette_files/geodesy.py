"""Latitudes and longitudes as positions in a plane around an origin, and back; speeds and courses as velocities."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Axis, Mask, Space, fields
from vedette_files.libraries import needed
from vedette_files.readers import NORTH_EAST, east_north

GEODETIC: Space = Space.of(latitude="deg", longitude="deg", altitude="m")
"""Above the ellipsoid WGS 84."""

COURSE = Space.of(speed="m/s", course="rad mod 2pi")
"""Over ground; the course runs clockwise from north."""

PLANE = Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s")

MADE = {
    "x": ("latitude", "longitude"),
    "y": ("latitude", "longitude"),
    "z": ("latitude", "longitude", "altitude"),
    "vx": ("speed", "course"),
    "vy": ("speed", "course"),
}
"""What each axis of the plane is made of where a file does not give it."""

FAR, FARTHEST = 200e3, 1500e3
"""m from the origin on the ground: beyond the first the plane differs from it by more than 0.02 %, which is told; what lies
beyond the second is refused, long before the far side of the earth folds over.
"""
NORTHWARD = 1e-4
"""deg, so little that a meridian is straight, and no digit is lost."""
EQUATOR, FLATTENING = 6378137.0, 1 / 298.257223563
"""Radius in m, and flattening, of the ellipsoid WGS 84."""
RADIUS = 6371e3
"""Mean radius of the earth in m."""


class BeyondPlane(ValueError):
    """A place that is too far from the origin."""


@final
@frozen
class Origin:
    """Where x, y and z are 0 on the ellipsoid WGS 84: the plane touches it there, and z points up."""

    latitude: float = fields.quantity("deg", "of the origin, north positive", at_least=-90, at_most=90)
    longitude: float = fields.quantity("deg", "of the origin, east positive", at_least=-180, at_most=360)
    altitude: float = fields.quantity("m", "of the origin above the ellipsoid", default=0.0)

    @classmethod
    def among(cls, positions: Array) -> Origin:
        """Return the middle of latitudes and longitudes (k, 2) in deg, to 1e-4 deg; 0, 0 if there is none."""
        if not len(positions):
            return cls(0.0, 0.0)
        first = positions[0, 1]
        turned = (positions[:, 1] - first + 180.0) % 360.0 - 180.0  # they may lie on both sides of 180 deg
        longitude = (float(np.median(turned)) + first + 180.0) % 360.0 - 180.0
        return cls(round(float(np.median(positions[:, 0])), 4), round(longitude, 4))

    def on_ground(self, latitude: Array | float, longitude: Array | float) -> Array:
        """Return the distance (*b) in m along the ground, to 0.5 %, of latitudes and longitudes (*b) in deg."""
        latitude_here, there = np.radians(self.latitude), np.radians(latitude)
        across = np.radians(np.asarray(longitude) - self.longitude)
        half = np.sin((there - latitude_here) / 2) ** 2 + np.cos(latitude_here) * np.cos(there) * np.sin(across / 2) ** 2
        return _floats(2 * RADIUS * np.arcsin(np.sqrt(np.minimum(half, 1.0))))

    def reaches(self, latitude: Array | float, longitude: Array | float) -> Mask:
        """Return which of some places (*b) in deg are no farther than FARTHEST."""
        return self.on_ground(latitude, longitude) <= FARTHEST

    def check_reach(self, latitude: Array | float, longitude: Array | float) -> None:
        """Raise BeyondPlane for a place beyond FARTHEST."""
        if (farthest := float(np.fmax.reduce(np.ravel(self.on_ground(latitude, longitude)), initial=0.0))) > FARTHEST:
            told = f"{farthest / 1e3:,.0f} km from the origin {self}"
            reach = f"and a plane around it reaches {FARTHEST / 1e3:,.0f} km"
            raise BeyondPlane(f"lies {told}, {reach}: track what is there in a run of its own, with another `origin`")

    def to_plane(self, latitude: Array, longitude: Array, altitude: Array | float = 0.0) -> tuple[Array, Array, Array]:
        """Return east, north and up (*b) in m of latitudes and longitudes (*b) in deg, altitudes in m."""
        origin = (self.latitude, self.longitude, self.altitude)
        east, north, up = _pymap3d("geodetic2enu")(latitude, longitude, altitude, *origin)
        return _floats(east), _floats(north), _floats(up)

    def from_plane(self, east: Array, north: Array, up: Array | None) -> tuple[Array, Array, Array]:
        """Return latitude and longitude (*b) in deg and altitude in m; without `up`, of points at altitude 0."""
        origin, back = (self.latitude, self.longitude, self.altitude), _pymap3d("enu2geodetic")
        height = np.zeros(np.shape(east)) - self.altitude if up is None else up
        latitude, longitude, altitude = back(east, north, height, *origin)
        for _ in range(4 if up is None else 0):  # the ground falls off from the plane: follow it down
            height = height - altitude
            latitude, longitude, altitude = back(east, north, height, *origin)
        return _floats(latitude), _floats(longitude), _floats(altitude)

    def north(self, latitude: Array, longitude: Array) -> Array:
        """Return where north is at places (*b) in deg: clockwise from the plane's, in rad, as meridians run together."""
        here, there = self.to_plane(latitude, longitude), self.to_plane(latitude + NORTHWARD, longitude)
        return _floats(np.arctan2(there[0] - here[0], there[1] - here[1]))

    def __str__(self) -> str:
        return f"{self.latitude!r}, {self.longitude!r}, {self.altitude!r}"

    @classmethod
    def of(cls, note: str) -> Origin:
        """Return the origin that a recording's note `origin` states, in deg and m; ValueError if it states none."""
        return cls(*(float(part) for part in note.split(",")))


def curvature_radii(latitude: Array | float) -> tuple[Array, Array]:
    """Return the radii (*b) in m with which the ellipsoid curves along a meridian and across it, at latitudes in rad."""
    squared = FLATTENING * (2 - FLATTENING)
    w = 1 - squared * np.sin(latitude) ** 2
    return _floats(EQUATOR * (1 - squared) / w**1.5), _floats(EQUATOR / np.sqrt(w))


def complaint(columns: Mapping[str, str]) -> str | None:
    """Return what is wrong with the columns of a table that may give latitudes or courses; None if nothing is."""
    for pair in (("latitude", "longitude"), ("speed", "course")):
        given = [name for name in pair if name in columns]
        if len(given) == 1:
            return f"must also name a column for {next(name for name in pair if name not in given)}"
        for name, parts in MADE.items():
            if given and name in columns and parts == pair:
                return f"name columns for {name}, or for {' and '.join(pair)}, not for both"
    if "altitude" in columns and ("latitude" not in columns or "z" in columns):
        return "altitude goes with latitude and longitude, without z"
    return None


def axes_read(wanted: Space, columns: Mapping[str, str]) -> tuple[Space, list[str]]:
    """Return the axes of a file that give those that are wanted, and the wanted ones that nothing gives."""
    known = {axis.name: axis for axis in (*GEODETIC.axes, *COURSE.axes)}
    axes: dict[str, Axis] = {}
    absent = []
    for axis in wanted.axes:
        if axis.name in columns:
            axes[axis.name] = axis
        elif all(name in columns for name in MADE.get(axis.name, ("",))):
            axes |= {name: known[name] for name in MADE[axis.name]}
        else:
            absent.append(axis.name)
    return Space(tuple(axes.values())), absent


def check_place(read: Space, values: Sequence[float], origin: Origin | None) -> None:
    """Raise BeyondPlane for a row of a file whose place is too far from the origin for a plane."""
    if origin is not None and is_geodetic(read):
        origin.check_reach(*(values[read.names.index(name)] for name in ("latitude", "longitude")))


def off_by(distance: float) -> float:
    """Return the share by which the plane falls short of a distance on the ground in m."""
    return 1.0 - float(np.sinc(distance / RADIUS / np.pi))


def made(read: Space) -> Space:
    """Return the axes that those of a file become: positions and velocities in the plane first."""
    names = [name for name, parts in MADE.items() if name in read or all(part in read for part in parts)]
    rest = [axis for axis in read.axes if axis.name not in GEODETIC and axis.name not in COURSE and axis.name not in names]
    by_name = {axis.name: axis for axis in (*PLANE.axes, *read.axes)}
    return Space((*(by_name[name] for name in names), *rest))


def is_geodetic(read: Space) -> bool:
    """Return whether positions are latitudes and longitudes."""
    return "latitude" in read


def into_plane(read: Space, values: Sequence[Sequence[float]], origin: Origin | None, frame: str) -> Array:
    """Return values (k, n) over `made(read)`, of a file's values (k, m); `frame` says where x and y point."""
    given = dict(zip(read.names, np.array(values, dtype=float).reshape(-1, len(read)).T, strict=True))
    east, north = east_north(frame)
    if is_geodetic(read) and origin is not None:
        place = origin.to_plane(given["latitude"], given["longitude"], given.get("altitude", 0.0))
        given |= dict(zip((east, north, "z"), place, strict=True))
        turn = origin.north(given["latitude"], given["longitude"])
        for angle, way in (("course", 1.0), ("heading", 1.0 if frame == NORTH_EAST else -1.0)):
            given |= {angle: given[angle] + way * turn} if angle in given else {}
    if "course" in read:
        given |= {f"v{east}": given["speed"] * np.sin(given["course"])}
        given |= {f"v{north}": given["speed"] * np.cos(given["course"])}
    return np.stack([given[name] for name in made(read).names], axis=-1)


def _pymap3d(name: str) -> Callable[..., tuple[Array, Array, Array]]:
    library = needed("pymap3d", "latitudes and longitudes need pymap3d", "data")
    return getattr(library, name)


def _floats(values: Array) -> Array:
    return np.asarray(values, dtype=float)
