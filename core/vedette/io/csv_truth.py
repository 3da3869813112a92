"""The truth and the platform's positions in a CSV recording."""

from __future__ import annotations

from pathlib import Path
from typing import final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.errors import Problem
from vedette.io.csv_table import chosen, numbers, rows
from vedette.io.opening import shown
from vedette.io.reading import Sample, in_time_order
from vedette.space import Space
from vedette.types import Pose, Trajectory

STATE = Space.of(
    x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s", ax="m/s^2", ay="m/s^2", turn_rate="rad/s", heading="rad mod 2pi"
)
"""The axes that a truth file may give."""

POSE = Space.of(x="m", y="m", vx="m/s", vy="m/s", heading="rad mod 2pi")
"""The axes that a platform may give."""


@final
@frozen
class TruthColumns:
    """The columns of the true states: one row per object and time."""

    file: str = fields.text("file beside the detections")
    time: str = fields.text("column of the time")
    columns: dict[str, str] = fields.names(
        "state axis to its column, such as x = 'north_m'; axes: " + ", ".join(STATE.names)
    )
    units: dict[str, str] = fields.names("state axis, or time, to its column's unit where that is not SI: heading = 'deg'")
    object: str = fields.text("column of the object's name; default: all rows are one object", default="")
    name: str = fields.text("name of the one object", default="target")

    def wanted(self) -> dict[str, str]:
        """Return the columns to find besides those of the axes: name in this table to title in the file."""
        named = {"time": self.time, "object": self.object}
        return {name: title for name, title in named.items() if title}

    def read(self, folder: Path, delimiter: str, refused: list[Problem], *, sort: bool) -> tuple[Trajectory, ...]:
        """Return a trajectory for each object, in the order of their first rows."""
        place = "truth"
        space = chosen(self.columns, STATE, place)
        by_axis = numbers(space, self.time, self.columns, self.units, place)
        wanted = {column.name: column.title for column in by_axis.values()} | self.wanted()
        objects: dict[str, list[Sample[list[float]]]] = {}
        for row in rows(folder / self.file, wanted, place, delimiter, refused):
            try:
                time = by_axis["time"].of(row)
                state = [by_axis[name].of(row) for name in space.names]
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
                continue
            objects.setdefault(row.cells.get("object", self.name), []).append(Sample(row.place, time, state))
        return tuple(_trajectory(name, space, in_time_order(found, refused, sort=sort)) for name, found in objects.items())


def _trajectory(name: str, space: Space, samples: list[Sample[list[float]]]) -> Trajectory:
    times = np.array([sample.time for sample in samples])
    states = np.array([sample.value for sample in samples])
    return Trajectory(name, space, times, space.canonical(states))


@final
@frozen
class PlatformColumns:
    """The columns of the platform's positions: by scan, or at times of their own, which are interpolated linearly."""

    columns: dict[str, str] = fields.names("x, y and, if known, vx, vy, heading to their columns")
    units: dict[str, str] = fields.names("axis, or time, to its column's unit where that is not SI: heading = 'deg'")
    file: str = fields.text("file beside the detections; default: their own", default="")
    scan: str = fields.text("column of the scan, as in the detections; or else give `time`", default="")
    time: str = fields.text("column of the time; or else give `scan`", default="")

    def __attrs_post_init__(self) -> None:
        if bool(self.scan) == bool(self.time):
            raise ValueError(f"{'time' if self.time else 'scan'}: give exactly one of `scan` and `time`")
        lacking = [name for name in ("x", "y") if name not in self.columns]
        lacking += [
            other for name, other in (("vx", "vy"), ("vy", "vx")) if name in self.columns and other not in self.columns
        ]
        if lacking:
            raise ValueError(f"columns: must also name a column for {', '.join(lacking)}")

    def wanted(self) -> dict[str, str]:
        """Return the columns to find besides those of the axes: name in this table to title in the file."""
        named = {"time": self.time, "scan": self.scan}
        return {name: title for name, title in named.items() if title}

    def read(self, path: Path, delimiter: str, refused: list[Problem], *, sort: bool) -> Platform:
        """Return the platform's states; of two rows for one scan that disagree, the second is refused."""
        place = "platform"
        space = chosen(self.columns, POSE, place)
        by_axis = numbers(space, self.time, self.columns, self.units, place)
        wanted = {column.name: column.title for column in by_axis.values()} | self.wanted()
        at_times: list[Sample[list[float]]] = []
        by_scan: dict[str, list[float]] = {}
        used = 0
        for row in rows(path, wanted, place, delimiter, refused):
            try:
                state = [by_axis[name].of(row) for name in space.names]
                if self.time:
                    at_times.append(Sample(row.place, by_axis["time"].of(row), state))
                elif by_scan.setdefault(row.cells["scan"], state) == state:
                    used += 1
                else:
                    raise ValueError(f"the platform stood elsewhere in an earlier row of scan {shown(row.cells['scan'])}")
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
        kept = in_time_order(at_times, refused, sort=sort)
        return Platform(_trajectory("platform", space, kept) if kept else None, by_scan, space, used or len(kept))


@frozen(eq=False)
class Platform:
    """A platform's states over `space`: along a track in time, or by scan; `rows` said so."""

    track: Trajectory | None
    by_scan: dict[str, list[float]]
    space: Space
    rows: int

    def pose(self, scan: str, time: float) -> Pose | None:
        """Return the pose for a scan at a time in s; None if the recording does not state it."""
        if self.track is None:
            state = np.array(self.by_scan[scan]) if scan in self.by_scan else None
        else:
            state = self.track.at(time)
        if state is None:
            return None
        moving = "vx" in self.space
        heading = float(state[-1]) if "heading" in self.space else 0.0
        return Pose(state[:2], state[2:4] if moving else None, heading)
