"""From what a message measures to what a sensor of the tracker measures."""

from __future__ import annotations

from collections.abc import Container, Mapping
from math import pi
from typing import final

import numpy as np
from attrs import Factory, field, frozen

from vedette.roles import Sensor
from vedette.space import Array, Mask, Space
from vedette.streams import Message
from vedette.types import Pose
from vedette_files import FRAMES, Origin, east_north
from vedette_live.stations import DIRECTED, Site, Station

_PLACES = ("x", "y", "z")


def _stations(self: Placing) -> dict[str, Station]:
    """Return where each sensor stands that measures ranges or directions: at its site, or where its parameters say."""
    return {
        name: Station.of(sensor, self.origin, self.frame)
        if self.origin is None or name not in self.sites
        else Station.at(self.sites[name].place, self.origin)
        for name, sensor in self.sensors.items()
        if any(axis in sensor.measurement for axis in DIRECTED)
    }


@final
@frozen
class Placing:
    """Finds the sensor of a message, by its `names` in the stream, and puts its columns over the sensor's axes.

    A bearing is made of an azimuth clockwise from north, x and y, which point as `frame` says, of east and north; positions
    of latitudes and longitudes around the `origin`, velocities of speed and course. z takes an altitude; x and y without
    one are of the ground. Sensors of `sites` have a north and a level of their own. A range that comes with an altitude or
    an elevation is a slant one: a sensor of the plane gets that along it. What tells another frame is refused.
    """

    sensors: Mapping[str, Sensor]
    names: Mapping[str, str]
    origin: Origin | None
    frame: str = FRAMES[0]
    sites: Mapping[str, Site] = Factory(dict)
    _at: dict[str, Station] = field(init=False, repr=False, eq=False, default=Factory(_stations, takes_self=True))

    def pose(self, name: str) -> Pose | None:
        """Return where a sensor stands that has a site; None for others, whose parameters say it."""
        return self._at[name].pose(self.sensors[name], self.frame) if name in self.sites else None

    def doubts(self) -> tuple[str, ...]:
        """Return a sentence for each sensor whose north may not be the one that is meant."""
        told = (station.askew(name, self.sensors[name]) for name, station in self._at.items())
        return tuple(sentence for sentence in told if sentence)

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
        if "range_rate" in wanted and message.pose is not None and message.pose.velocity is None:
            told = f"must be given, as {name!r} measures range_rate relative to its platform"
            raise ValueError(f"pose.velocity: {told}: 0 of one at rest, or where its motion is taken out")
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
        axes = wanted.names if message.axes is None else message.axes
        if axes == wanted.names:
            if z.shape[1] != len(wanted):
                raise ValueError(f"z: must have {len(wanted)} columns, {_listed(wanted)}, got {z.shape[1]}")
            if name not in self.sites:
                return z
        columns = dict(zip(axes, z.T, strict=True))
        columns |= self._directed(columns, wanted, name)
        columns |= self._made(columns, wanted)
        absent = [axis for axis in wanted.names if axis not in columns and axis not in may]
        if absent:
            told = "; z needs an altitude" if "z" in absent and "latitude" in columns else ""
            raise ValueError(f"z: sensor {name!r} measures {_listed(wanted)}, and {', '.join(axes)} do not give it{told}")
        nothing = np.full(len(z), np.nan)
        return np.stack([columns.get(axis, nothing) for axis in wanted.names], axis=-1)

    def _directed(self, columns: Mapping[str, Array], wanted: Space, name: str) -> dict[str, Array]:
        """Return range, range rate, bearing and elevation in the plane's axes, as far as they are wanted and can be made."""
        eastward, made = east_north(self.frame) == ("x", "y"), dict[str, Array]()
        if name not in self._at or ("azimuth" not in columns and "bearing" not in columns):
            return made
        azimuth = columns.get("azimuth")
        if azimuth is None:
            azimuth = pi / 2 - columns["bearing"] if eastward else columns["bearing"]
        if name in self.sites or ("range" in columns and ("altitude" in columns or "elevation" in columns)):
            flat = "elevation" not in wanted
            made |= self._at[name].in_plane({**columns, "azimuth": azimuth}, flat=flat)
        if "azimuth" in made or "azimuth" in columns:
            azimuth = made.get("azimuth", azimuth)
            made["bearing"] = pi / 2 - azimuth if eastward else azimuth
        return made

    def _made(self, columns: Mapping[str, Array], wanted: Space) -> dict[str, Array]:
        made, course = dict[str, Array](), columns.get("course")
        ground = east_north(self.frame)
        if "east" in columns and "north" in columns:
            made |= dict(zip(ground, (columns["east"], columns["north"]), strict=True))
        if "east_speed" in columns and "north_speed" in columns:
            made |= {f"v{ground[0]}": columns["east_speed"], f"v{ground[1]}": columns["north_speed"]}
        if "latitude" in columns and "longitude" in columns and any(name in wanted for name in _PLACES):
            if self.origin is None:
                raise ValueError("latitude, longitude: the config names no origin, where x and y are 0")
            self.origin.check_reach(columns["latitude"], columns["longitude"])
            height = columns.get("altitude", np.zeros(1))
            place = self.origin.to_plane(columns["latitude"], columns["longitude"], np.where(np.isnan(height), 0.0, height))
            made |= dict(zip(ground, place[:2], strict=True))
            if "altitude" in columns:
                made["z"] = np.where(np.isnan(height), np.nan, place[2])
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
