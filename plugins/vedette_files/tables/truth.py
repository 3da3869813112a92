"""The truth in a CSV recording."""

from __future__ import annotations

from pathlib import Path
from typing import final

import numpy as np
from attrs import frozen

from vedette import Problem, Space, Trajectory, fields
from vedette_files.geodesy import check_place, complaint, into_plane, made
from vedette_files.readers import Sample, in_time_order
from vedette_files.tables.layout import Layout, chosen
from vedette_files.tables.rows import rows

STATE = Space.of(
    x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s", ax="m/s^2", ay="m/s^2", turn_rate="rad/s", heading="rad mod 2pi"
)
"""The axes that a truth file may give."""


@final
@frozen
class TruthColumns:
    """The columns of the true states: one row per object and time."""

    file: str = fields.text("file beside the detections")
    time: str = fields.text("column of the time")
    columns: dict[str, str] = fields.names(
        "state axis to its column, such as x = 'north_m'; axes: "
        + ", ".join(STATE.names)
        + "; or latitude, longitude, altitude, speed, course"
    )
    units: dict[str, str] = fields.names("state axis, or time, to its column's unit where that is not SI: heading = 'deg'")
    object: str = fields.text("column of the object's name; default: all rows are one object", default="")
    name: str = fields.text("name of the one object", default="target")

    def __attrs_post_init__(self) -> None:
        if wrong := complaint(self.columns):
            raise ValueError(f"columns: {wrong}")

    def wanted(self) -> dict[str, str]:
        """Return the columns to find besides those of the axes: name in this table to title in the file."""
        named = {"time": self.time, "object": self.object}
        return {name: title for name, title in named.items() if title}

    def read(self, folder: Path, layout: Layout, refused: list[Problem]) -> tuple[Trajectory, ...]:
        """Return a trajectory for each object, in the order of their first rows."""
        place, path = "truth", folder / self.file
        space = chosen(self.columns, STATE, place)
        by_axis = layout.columns(path, space, self, place)
        wanted = {column.name: column.title for column in by_axis.values()} | self.wanted()
        objects: dict[str, list[Sample[list[float]]]] = {}
        for row in rows(path, wanted, place, layout.dialect, refused):
            try:
                time = by_axis["time"].of(row)
                state = [by_axis[name].of(row) for name in space.names]
                check_place(space, state, layout.origin)
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
                continue
            objects.setdefault(row.cells.get("object", self.name), []).append(Sample(row.place, time, state))
        return tuple(
            trajectory(name, space, in_time_order(samples, refused, sort=layout.sort), layout)
            for name, samples in objects.items()
        )


def trajectory(name: str, read: Space, samples: list[Sample[list[float]]], layout: Layout) -> Trajectory:
    """Return the states of one object, of a file's values over `read`."""
    times, space = np.array([sample.time for sample in samples]), made(read)
    states = into_plane(read, [sample.value for sample in samples], layout.origin, layout.frame)
    return Trajectory(name, space, times, space.canonical(states))
