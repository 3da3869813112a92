"""Where a fixed radar stands on the earth: from its own north and vertical, and from heights, to the tracker's plane."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.errors import Problem
from vedette.roles import Sensor
from vedette.space import Array
from vedette.types import Pose
from vedette_files import Origin, curvature_radii, east_north
from vedette_standard import stands

STEEP = 0.1
"""Cosine of the elevation, 84 deg, above which a range rate is no longer divided by it. By hand: there a radar's cone of
silence has begun, and the quotient would be noise.
"""
NEAR = 1e-3
"""m below which a range is that."""
DIRECTED = ("range", "bearing", "elevation")
"""Axes that depend on where a sensor stands."""


@final
@frozen
class Site:
    """Where a fixed sensor stands on the ellipsoid WGS 84: its azimuths are from north there, its elevations from level."""

    latitude: float = fields.quantity("deg", "of the sensor, north positive", at_least=-90, at_most=90)
    longitude: float = fields.quantity("deg", "of the sensor, east positive", at_least=-180, at_most=360)
    altitude: float = fields.quantity("m", "of the sensor above the ellipsoid", default=0.0)

    @property
    def place(self) -> Origin:
        """The same as where a plane touches the earth."""
        return Origin(self.latitude, self.longitude, self.altitude)


def misplaced(sites: Mapping[str, Site], sensors: Mapping[str, Sensor], origin: Origin | None) -> list[Problem]:
    """Return what is wrong with the sites of some sensors."""
    problems = []
    for name, site in sites.items():
        place, sensor = f"sites.{name}", sensors.get(name)
        if sensor is None:
            problems.append(Problem(place, f"names no sensor of the tracker: must be {' or '.join(map(repr, sensors))}"))
        elif origin is None:
            problems.append(Problem(place, "needs an origin, where x and y are 0"))
        elif not origin.reaches(site.latitude, site.longitude):
            problems.append(Problem(place, f"is too far from the origin {origin} for one plane"))
        elif not any(axis in sensor.measurement for axis in DIRECTED):
            problems.append(Problem(place, f"says nothing to {sensor.kind!r}, which measures neither range nor direction"))
        elif (pose := stands(sensor)) is not None and np.any(pose.position):
            problems.append(Problem(place, f"gives the sensor its x, y and z: leave them out of sensors.{name}"))
    return problems


@final
@frozen(eq=False)
class Station:
    """A fixed sensor: its `place`, its `position` (3,) in the plane: east, north and up, and `axes` (3, 3), the directions
    of its own east, north and up there, as columns. `northed`: its azimuths are from its own north, else from the plane's.

    A target of which a height is known is placed exactly; one without is taken to be at the radar's own level.
    """

    place: Origin
    position: Array
    axes: Array
    northed: bool

    @classmethod
    def at(cls, site: Origin, origin: Origin) -> Station:
        """Return that of a sensor whose place on the earth is known."""
        position = np.stack(origin.to_plane(np.array(site.latitude), np.array(site.longitude), site.altitude))
        return cls(site, position, _directions(origin) @ _directions(site).T, northed=True)

    @classmethod
    def of(cls, sensor: Sensor, origin: Origin | None, frame: str) -> Station:
        """Return that of a sensor that stands at its own x, y and, if it has one, z; without origin, as at 45 deg north."""
        pose, (first, _) = stands(sensor), east_north(frame)
        x, y, height = np.zeros(3) if pose is None else np.append(pose.position, 0.0)[:3]
        east, north = (x, y) if first == "x" else (y, x)
        if origin is None:
            return cls(Origin(45.0, 0.0, height), np.array([east, north, height]), np.eye(3), northed=False)
        here = np.array(east), np.array(north)
        latitude, longitude, altitude = origin.from_plane(*here, np.array(height) if "z" in sensor.observes else None)
        place = Origin(float(latitude), float(longitude), float(altitude) if "z" in sensor.observes else origin.altitude)
        return cls(place, np.array([east, north, height]), _directions(origin) @ _directions(place).T, northed=False)

    def pose(self, sensor: Sensor, frame: str) -> Pose:
        """Return where it stands in the tracker's axes; a heading that the sensor states stays."""
        own = stands(sensor)
        there = self.position if east_north(frame)[0] == "x" else self.position[[1, 0, 2]]
        return Pose(there if "z" in sensor.observes else there[:2], heading=0.0 if own is None else own.heading)

    def askew(self, name: str, sensor: Sensor) -> str:
        """Return a sentence if its own north is farther from the plane's than its bearings err, and no heading is stated."""
        pose = stands(sensor)
        if self.northed or pose is None or np.any(pose.heading) or "bearing" not in sensor.measurement:
            return ""
        turn = float(np.arctan2(self.axes[0, 1], self.axes[1, 1]))
        i = sensor.measurement.names.index("bearing")
        sigma = float(np.sqrt(sensor.noise(np.zeros(len(sensor.observes)))[..., i, i]))
        if abs(turn) <= sigma:
            return ""
        turned, err = (f"{np.degrees(angle):.2g} deg" for angle in (abs(turn), sigma))
        told = f"north there is {turned} from the plane's, and its bearings err by {err}"
        return f"{name}: {told}: if they are from its own north, say by `sites` where it stands"

    def level(self, r: Array, azimuth: Array, altitude: Array) -> Array:
        """Return the elevation (k,) above its own horizon of what is r away at an altitude, over the sphere that curves
        as the ellipsoid does in that direction. What is higher than it is far is overhead.
        """
        along, across = curvature_radii(np.radians(self.place.latitude))
        radius = 1 / (np.cos(azimuth) ** 2 / along + np.sin(azimuth) ** 2 / across) + self.place.altitude
        up = ((altitude - self.place.altitude) * (2 * radius + altitude - self.place.altitude) - r**2) / (2 * radius)
        elevation: Array = np.arcsin(np.clip(up / np.maximum(r, NEAR), -1.0, 1.0))
        return elevation

    def in_plane(self, columns: Mapping[str, Array], *, flat: bool) -> dict[str, Array]:
        """Return the columns, azimuth among them, that change in the plane's axes. `flat`: ranges and range rates along it.

        A range rate is divided by the cosine of the elevation, as of a target that neither climbs nor descends.
        """
        azimuth, r, elevation = columns["azimuth"], columns.get("range"), columns.get("elevation")
        if elevation is None and r is not None and "altitude" in columns:
            elevation = self.level(r, azimuth, columns["altitude"])
        known = np.zeros(azimuth.shape, dtype=bool) if elevation is None else ~np.isnan(elevation)
        level = np.zeros(azimuth.shape) if elevation is None else np.where(known, elevation, 0.0)
        own = np.stack([np.cos(level) * np.sin(azimuth), np.cos(level) * np.cos(azimuth), np.sin(level)], axis=-1)
        seen = own @ self.axes.T
        made = dict[str, Array]()
        if self.northed:
            made["azimuth"] = np.arctan2(seen[:, 0], seen[:, 1])
        if elevation is not None:
            made["elevation"] = np.where(known, np.arcsin(np.clip(seen[:, 2], -1.0, 1.0)), np.nan)
        share = np.hypot(seen[:, 0], seen[:, 1])
        if flat and r is not None:
            made["range"] = np.where(known, r * share, r)
        if flat and "range_rate" in columns:
            rate = columns["range_rate"]
            made["range_rate"] = np.where(known, rate / np.maximum(share, STEEP), rate)
        return made


def _directions(place: Origin) -> Array:
    """Return east, north and up at a place, rows (3, 3) in the axes of the earth."""
    latitude, longitude = np.radians(place.latitude), np.radians(place.longitude)
    east = [-np.sin(longitude), np.cos(longitude), 0.0]
    outward = np.array([np.cos(longitude), np.sin(longitude)])
    north = [*(-np.sin(latitude) * outward), np.cos(latitude)]
    return np.array([east, north, [*(np.cos(latitude) * outward), np.sin(latitude)]])
