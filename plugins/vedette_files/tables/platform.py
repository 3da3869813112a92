"""Where the sensors' platforms stand in a CSV recording."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import final

import numpy as np
from attrs import Factory, evolve, field, frozen

from vedette import ConfigError, Pose, Problem, Space, Trajectory, fields
from vedette_files.geodesy import check_place, complaint, into_plane, is_geodetic, made
from vedette_files.input_files import shown
from vedette_files.readers import Sample, in_time_order
from vedette_files.tables.columnar import TablePath
from vedette_files.tables.layout import Layout, chosen
from vedette_files.tables.rows import rows
from vedette_files.tables.truth import trajectory

POSE = Space.of(x="m", y="m", z="m", vx="m/s", vy="m/s", heading="rad mod 2pi")
"""The axes that a platform may give."""

PLACE = "platform"

_MOVES = Space.of(vx="m/s", vy="m/s", vz="m/s")
_TURN = Space.of(turn="rad/s")


@final
@frozen
class Mounting:
    """Where a sensor is on its platform, along axes that turn with the platform's heading."""

    x: float = fields.quantity("m", "ahead, along the heading", default=0.0)
    y: float = fields.quantity(
        "m", "where bearings from ahead are 90 deg: to the left if x is east and y north", default=0.0
    )
    heading: float = fields.quantity("rad", "its bearing 0, from ahead", default=0.0)


@final
@frozen
class PlatformColumns:
    """The columns of the platforms' positions: by scan, or at times of their own, which are interpolated linearly.

    A velocity that no column tells is the slope of the positions. Rows are left out whose cells of these columns are all
    empty.
    """

    columns: dict[str, str] = fields.names(
        "x, y (or latitude, longitude) and, if known, vx, vy (or speed, course), heading to their columns"
    )
    units: dict[str, str] = fields.names("axis, or time, to its column's unit where that is not SI: heading = 'deg'")
    file: str = fields.text("file beside the detections; default: their own", default="")
    scan: str = fields.text("column of the scan, as in the detections; or else give `time`", default="")
    time: str = fields.text("column of the time; or else give `scan`", default="")
    object: str = fields.text("column of the platform's name, if there are several; default: there is one", default="")
    sensors: dict[str, str] = fields.names(
        "sensor to the name of its platform; the others stand still. Default: each sensor's platform has its name, "
        "or is the only one"
    )
    mounted: dict[str, Mounting] = fields.part(
        "sensor to where it is on its platform; default: at its place", default=Factory(dict)
    )
    over_ground: bool = fields.flag(
        "range rates are over ground, without the platform's own motion: it counts as at rest", default=False
    )

    def __attrs_post_init__(self) -> None:
        if bool(self.scan) == bool(self.time):
            raise ValueError(f"{'time' if self.time else 'scan'}: give exactly one of `scan` and `time`")
        if wrong := complaint(self.columns):
            raise ValueError(f"columns: {wrong}")
        lacking = [name for name in ("x", "y") if name not in self.columns and "latitude" not in self.columns]
        lacking += [
            other for name, other in (("vx", "vy"), ("vy", "vx")) if name in self.columns and other not in self.columns
        ]
        if lacking:
            raise ValueError(f"columns: must also name a column for {', '.join(lacking)}")
        if self.sensors and not self.object:
            raise ValueError("object: missing: the column with the names of the platforms, which `sensors` gives")

    def wanted(self) -> dict[str, str]:
        """Return the columns to find besides those of the axes: name in this table to title in the file."""
        named = {"time": self.time, "scan": self.scan, "object": self.object}
        return {name: title for name, title in named.items() if title}

    def read(self, path: TablePath, layout: Layout, refused: list[Problem]) -> Platforms:
        """Return the platforms' states; of two rows for one scan that disagree, the second is refused."""
        space = chosen(self.columns, POSE, PLACE)
        by_axis = layout.columns(path, space, self, PLACE)
        if is_geodetic(space) and "heading" not in space:  # north is not everywhere the plane's
            space = Space((*space.axes, POSE.axes[-1]))
        wanted = {column.name: column.title for column in by_axis.values()} | self.wanted()
        at_times: dict[str, list[Sample[list[float]]]] = {}
        by_scan: dict[tuple[str, str], list[float]] = {}
        used = left_out = 0
        for row in rows(path, wanted, PLACE, layout.dialect, refused):
            if not any(row.cells[by_axis[name].name] for name in space.names if name in by_axis):
                left_out += 1
                continue
            name = row.cells.get("object", "")
            try:
                state = [by_axis[axis].of(row) if axis in by_axis else 0.0 for axis in space.names]
                check_place(space, state, layout.origin)
                if self.time:
                    at_times.setdefault(name, []).append(Sample(row.place, by_axis["time"].of(row), state))
                elif by_scan.setdefault((name, row.cells["scan"]), state) == state:
                    used += 1
                else:
                    raise ValueError(
                        f"the platform has another position in an earlier row of scan {shown(row.cells['scan'])}"
                    )
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
        kept = {name: in_time_order(samples, refused, sort=layout.sort) for name, samples in at_times.items()}
        states = into_plane(space, list(by_scan.values()), layout.origin, layout.frame)
        return Platforms(
            tracks={name: _moving(trajectory("platform", space, samples, layout)) for name, samples in kept.items()},
            by_scan=dict(zip(by_scan, states, strict=True)),
            space=made(space),
            over_ground=self.over_ground,
            used=used + sum(map(len, kept.values())),
            left_out=left_out,
            names=self.sensors,
            mounted=self.mounted,
            several=bool(self.object),
        )


@frozen(eq=False)
class Platforms:
    """The platforms' states, by the platform's name: along tracks in time, or by scan, over `space`.

    `used` and `left_out` count their rows; `names` are the sensors' platforms, `mounted` where they are on them.
    """

    tracks: Mapping[str, Trajectory]
    by_scan: Mapping[tuple[str, str], np.ndarray]
    space: Space
    used: int
    left_out: int
    names: Mapping[str, str] = field(factory=dict)
    mounted: Mapping[str, Mounting] = field(factory=dict)
    several: bool = False
    over_ground: bool = False

    def timed(self, times: Mapping[str, float]) -> Platforms:
        """Return them with the velocities that states by scan lack; times: of the scans that there are, in s."""
        by_scan, space = dict[tuple[str, str], np.ndarray](), self.space
        for name in {name for name, _ in self.by_scan}:
            own = sorted((times[scan], scan) for other, scan in self.by_scan if other == name and scan in times)
            if own:
                states = np.array([self.by_scan[name, scan] for _, scan in own])
                moving = _moving(Trajectory(PLACE, self.space, np.array([time for time, _ in own]), states))
                by_scan |= {(name, scan): state for (_, scan), state in zip(own, moving.states, strict=True)}
                space = moving.space
        return evolve(self, by_scan=by_scan, space=space)

    @property
    def between(self) -> str:
        """When their tracks are known, in words, or ""."""
        times = [time for track in self.tracks.values() for time in track.times.tolist()]
        return f"; its rows are of {min(times)!r} to {max(times)!r} s: are their clocks alike?" if times else ""

    def check(self, sensors: Iterable[str]) -> None:
        """Raise ConfigError if `names` names a sensor or a platform that there is not."""
        there = {*self.tracks, *(name for name, _ in self.by_scan)}
        problems = [
            Problem(
                f"{PLACE}.sensors.{sensor}", f"the file has no platform {name!r}, only {', '.join(map(repr, sorted(there)))}"
            )
            for sensor, name in self.names.items()
            if name not in there
        ]
        known = list(sensors)
        problems += [
            Problem(f"{PLACE}.sensors.{sensor}", f"the tracker has no sensor {sensor!r}, only {', '.join(map(repr, known))}")
            for sensor in self.names
            if sensor not in known
        ]
        problems += [
            Problem(
                f"{PLACE}.mounted.{sensor}", f"no sensor {sensor!r} is on a platform, only {', '.join(map(repr, known))}"
            )
            for sensor in self.mounted
            if sensor not in known or not self.moves(sensor)
        ]
        if problems:
            raise ConfigError(problems)

    def moves(self, sensor: str) -> bool:
        """Return whether the sensor is on a platform."""
        return not self.names or sensor in self.names

    def pose(self, sensor: str, scan: str, time: float) -> Pose | None:
        """Return the pose of a sensor's platform for a scan at a time in s; None if the recording does not state it."""
        name = self.names.get(sensor, sensor) if self.several else ""
        track = self.tracks.get(name)
        space, state = (self.space, self.by_scan.get((name, scan))) if track is None else (track.space, track.at(time))
        if state is None:
            return None
        part = dict(zip(space.names, state, strict=True))
        axes = [axis for axis in ("x", "y", "z") if axis in part]
        velocity = np.zeros(len(axes)) if self.over_ground else np.array([part[f"v{axis}"] for axis in axes])
        position, heading = np.array([part[axis] for axis in axes]), float(part.get("heading", 0.0))
        if (mount := self.mounted.get(sensor)) is not None:
            c, s = np.cos(heading), np.sin(heading)
            arm = np.array([c * mount.x - s * mount.y, s * mount.x + c * mount.y])
            position[:2] += arm
            if arm.any() and not self.over_ground:
                velocity[:2] += part.get("turn", 0.0) * np.array([-arm[1], arm[0]])
            heading += mount.heading
        return Pose(position, velocity if np.all(np.isfinite(velocity)) else None, heading)


def _moving(track: Trajectory) -> Trajectory:
    """Return a path with the velocities that it lacks, and its turn: slopes of second order; NaN where it has one time."""
    lacking = [axis for axis in _MOVES.axes if axis.name[1:] in track.space and axis.name not in track.space]
    where = [track.space.names.index(axis.name[1:]) for axis in lacking]
    times, first, rows = np.unique(track.times, return_index=True, return_inverse=True)
    places = track.states[:, where]
    if "heading" in track.space:
        lacking += _TURN.axes
        heading = np.empty(len(rows))
        heading[:] = np.unwrap(track.states[first, track.space.names.index("heading")])[rows]
        places = np.column_stack([places, heading])
    slopes = np.gradient(places[first], times, axis=0)[rows] if len(times) > 1 else np.full(places.shape, np.nan)
    return evolve(track, space=Space((*track.space.axes, *lacking)), states=np.hstack([track.states, slopes]))
