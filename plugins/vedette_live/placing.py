"""From what a message measures to what a sensor of the tracker measures."""

from __future__ import annotations

from collections.abc import Container, Mapping
from math import pi
from typing import final

import numpy as np
from attrs import frozen

from vedette.roles import Sensor
from vedette.space import Array, Mask, Space
from vedette.streams import Message
from vedette_files import FRAMES, Origin, east_north

_PLACES = ("x", "y", "z")


@final
@frozen
class Placing:
    """Finds the sensor of a message, by its `names` in the stream, and puts its columns over the sensor's axes.

    A bearing is made of an azimuth clockwise from north, x and y, which point as `frame` says, of east and north; positions
    of latitudes and longitudes around the `origin`, velocities of speed and course. What tells another frame is refused.
    """

    sensors: Mapping[str, Sensor]
    names: Mapping[str, str]
    origin: Origin | None
    frame: str = FRAMES[0]

    def sensor(self, stated: str) -> str:
        """Return the tracker's name of a sensor; ValueError if it has no such one."""
        name = self.names.get(stated, stated)
        if name in self.sensors:
            return name
        if not stated and not self.names and len(self.sensors) == 1:
            return next(iter(self.sensors))
        if not stated:
            told = f"must be one of {', '.join(map(repr, self.sensors))}, for messages that do not tell theirs"
            raise ValueError(f"sensor: {told}"[:200])
        known = ", ".join(map(repr, (*self.names, *(name for name in self.sensors if name not in self.names.values()))))
        raise ValueError(f"sensor: must be one of {known}, got {stated!r}"[:200])

    def returns(self, message: Message, name: str) -> Array:
        """Return the returns (k, m) over the sensor's measurement, NaN where a component is missing.

        ValueError if they do not hold what it measures, or all lack what it always reports.
        """
        if message.frame not in ("", self.frame):
            told = f"must be that of the config, {self.frame!r}, got {message.frame!r}"
            raise ValueError(f"frame: {told}: state it as `frame`, where `origin` stands")
        wanted, may = self.sensors[name].measurement, self.sensors[name].optional
        z = self._over(message, name, wanted, may)
        always = [i for i, axis in enumerate(wanted.names) if axis not in may]
        if len(z) and np.isnan(z[:, always]).any(axis=-1).all():
            lacking = [wanted.names[i] for i in always if np.isnan(z[:, i]).any()]
            told = f"z: lacks {', '.join(lacking)}, which {name!r} always reports"
            raise ValueError(f"{told}; 'partial' around it takes returns without")
        return z

    def _over(self, message: Message, name: str, wanted: Space, may: Container[str]) -> Array:
        z = message.z
        if not len(z):
            return np.zeros((0, len(wanted)))
        if message.axes is None or message.axes == tuple(axis.name for axis in wanted.axes):
            if z.shape[1] != len(wanted):
                raise ValueError(f"z: must have {len(wanted)} columns, {_listed(wanted)}, got {z.shape[1]}")
            return z
        columns = {axis: z[:, i] for i, axis in enumerate(message.axes)}
        columns |= self._made(columns, wanted)
        absent = [axis for axis in wanted.names if axis not in columns and axis not in may]
        if absent:
            raise ValueError(f"z: sensor {name!r} measures {_listed(wanted)}, and {', '.join(message.axes)} do not give it")
        nothing = np.full(len(z), np.nan)
        return np.stack([columns.get(axis, nothing) for axis in wanted.names], axis=-1)

    def _made(self, columns: Mapping[str, Array], wanted: Space) -> dict[str, Array]:
        made, course = dict[str, Array](), columns.get("course")
        ground = east_north(self.frame)
        if "bearing" in wanted and "azimuth" in columns:
            made["bearing"] = columns["azimuth"] if ground == ("y", "x") else pi / 2 - columns["azimuth"]
        if "east" in columns and "north" in columns:
            made |= dict(zip(ground, (columns["east"], columns["north"]), strict=True))
        if "latitude" in columns and "longitude" in columns and any(name in wanted for name in _PLACES):
            if self.origin is None:
                raise ValueError("latitude, longitude: the config names no origin, where x and y are 0")
            self.origin.check_reach(columns["latitude"], columns["longitude"])
            place = self.origin.to_plane(columns["latitude"], columns["longitude"], columns.get("altitude", 0.0))
            made |= dict(zip((*ground, "z"), place, strict=True))
            course = None if course is None else course + self.origin.north(columns["latitude"], columns["longitude"])
        if "speed" in columns and course is not None:
            east, north = columns["speed"] * np.sin(course), columns["speed"] * np.cos(course)
            made |= {f"v{ground[0]}": east, f"v{ground[1]}": north}
        return made


def named(sensors: Mapping[str, str], sensor: str) -> dict[str, str]:
    """Return the tracker's sensor by its name in the stream; `sensor` is that of messages that name none."""
    return {**sensors, "": sensor} if sensor else dict(sensors)


def placed(origin: Origin | None, frame: str) -> dict[str, str]:
    """Return the notes of a recording that say where x and y are 0, and where they point."""
    if origin is None:
        return {} if frame == FRAMES[0] else {"frame": frame}
    return {"origin": str(origin), "frame": frame}


def missing(z: Array, sensor: Sensor) -> Mask | None:
    """Return which components of returns (k, m) are NaN as the sensor allows it; None for none: what is left is refused."""
    lacking: Mask = np.isnan(z) & [name in sensor.optional for name in sensor.measurement.names]
    return lacking if lacking.any() else None


def _listed(space: Space) -> str:
    return ", ".join(axis.name for axis in space.axes)
