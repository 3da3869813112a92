"""The returns of a CSV recording, grouped into scans."""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping, Sequence
from functools import cached_property, partial
from math import isnan, nan
from typing import final

from attrs import evolve, frozen

from vedette import ConfigError, Problem, Sensor, Space, SpaceError, fields
from vedette_files.codes import code_of_cell
from vedette_files.geodesy import MADE, BeyondPlane, axes_read, check_place, complaint, into_plane, made
from vedette_files.oddities import set_back
from vedette_files.readers import BEYOND_PLANE, Sample
from vedette_files.tables.columnar import TablePath
from vedette_files.tables.layout import Column, Layout, with_altitude
from vedette_files.tables.looks import Cells, Look, by_row, by_scan, by_time, by_turn
from vedette_files.tables.noise import noise_columns
from vedette_files.tables.numbers import Row
from vedette_files.tables.rows import BY_ROW, rows

POSITION = Space.of(x="m", y="m")
POLAR = ("range", "bearing")
PLACE = "detections"


@frozen
class Reading:
    """How one sensor's returns are read: the axes that it measures, and those of the file that they come from.

    `relative`: whether positions become range and bearing from the platform; `optional`: axes that a return may lack.
    """

    measured: Space
    read: Space
    relative: bool = False
    optional: Container[str] = ()

    @cached_property
    def absent(self) -> tuple[str, ...]:
        """The axes measured that no row has, as the file has no column of theirs."""
        return tuple(name for name in self.measured.names if name in self.optional and name not in self.placed)

    @cached_property
    def gaps(self) -> dict[str, list[str]]:
        """The axes of the file whose cells may be empty beside others, and those measured that a return then lacks."""
        made_of = {name: (name,) if name in self.read else MADE.get(name, ()) for name in self.measured.names}
        found = {}
        for axis in self.read.names:
            needed = "latitude" if axis == "altitude" else axis  # x and y are of all three
            gives = [name for name, parts in made_of.items() if needed in parts]
            if gives and all(name in self.optional for name in gives):
                found[axis] = gives
        return found

    @cached_property
    def placed(self) -> Space:
        """The axes of the file, with latitude and longitude as positions in the plane."""
        return made(self.read)


@final
@frozen
class DetectionColumns:
    """The columns of the returns: one row per return. Rows of one scan id, else successive rows of one time, form a scan.

    Where most rows of scans have times of their own, or with `turn`, each return is taken at its own time, and the scan is
    of its last one. Rows of one name, time and place are one message that was heard more than once: one return.
    """

    time: str = fields.text("column of the time")
    columns: dict[str, str] = fields.names(
        "measured axis to its column: x = 'north_m', bearing = 'azimuth'; latitude and longitude give x and y, with "
        "altitude z, speed and course give vx and vy"
    )
    units: dict[str, str] = fields.names(
        "measured axis, or time, to its column's unit where that is not SI: bearing = 'deg'"
    )
    file: str = fields.text("file in the folder `path`; default: `path` is the file", default="")
    scan: str = fields.text(
        "column that numbers the scans; `row`: each row is a scan; default: rows of one time are a scan", default=""
    )
    turn: float | None = fields.quantity(
        "s", "duration of a turn of the antenna, whose rows are a scan, where no column numbers them; default: none",
        default=None, above=0,
    )  # fmt: skip
    sensor: str = fields.text("the tracker's name of the sensor; default: its only one", default="")
    sensor_column: str = fields.text(
        "column with the tracker's name of the sensor, where several share the file; without it, a row is of the sensor "
        "whose columns it fills",
        default="",
    )
    identity: str = fields.text(
        "column by which returns name their objects, as an MMSI; an empty cell names none; default: none do", default=""
    )
    noise: dict[str, str] = fields.names(
        "measured axis to the column of a return's own deviation along it, x = 'sigma_x', or pair to that of their "
        "covariance, 'x y' = 'cov_xy', in units of the axes; x and y of latitudes are in m; default: the sensor's errors"
    )
    periods: dict[str, float] = fields.table(
        "sensor to its scan period, if scans without returns were not recorded: gaps of whole periods then hold them",
        unit="s",
    )

    def __attrs_post_init__(self) -> None:
        if self.sensor and self.sensor_column:
            raise ValueError("sensor: give either `sensor` or `sensor_column`")
        if self.scan and self.turn is not None:
            raise ValueError("turn: goes without `scan`, whose column numbers the turns")
        if wrong := complaint(self.columns):
            raise ValueError(f"columns: {wrong}")
        for name, period in self.periods.items():
            if period <= 0:
                raise ValueError(f"periods.{name}: must be > 0, got {period:g} s")

    def wanted(self) -> dict[str, str]:
        """Return the columns to find besides those of the axes: name in this table to title in the file."""
        scan = "" if self.scan == BY_ROW else self.scan
        named = {"time": self.time, "scan": scan, "sensor_column": self.sensor_column, "identity": self.identity}
        return {name: title for name, title in named.items() if title}

    def readings(self, sensors: Mapping[str, Sensor], with_platform: bool) -> dict[str, Reading]:
        """Return what to read for each sensor that the file holds; ConfigError if the columns are not what they measure."""
        names = [self.sensor] if self.sensor else list(sensors)
        known = ", ".join(map(repr, sensors))
        problems = [
            Problem(f"{PLACE}.{key}", f"the tracker has no sensor {name!r}, only {known}")
            for key, given in (("sensor", names), ("periods", self.periods))
            for name in given
            if name not in sensors
        ]
        columns = {}
        for name in names:
            if name in sensors:
                measured = sensors[name].measurement
                optional = sensors[name].optional
                read, without = axes_read(measured, self.columns)
                absent = [axis for axis in without if axis not in optional]
                position, lacking = axes_read(POSITION, self.columns)
                if not absent:
                    columns[name] = Reading(measured, with_altitude(read, self.columns), optional=optional)
                elif with_platform and set(measured.names) <= set(POLAR) and not lacking:
                    columns[name] = Reading(measured, with_altitude(position, self.columns), relative=True)
                else:
                    text = f"sensor {name!r} measures {measured}: name a column for {', '.join(absent)}"
                    problems.append(Problem(f"{PLACE}.columns", text))
        unread = [axis for axis in self.columns if not any(axis in reading.read for reading in columns.values())]
        if unread and not problems:
            measured_by = ", ".join(f"{name!r} {reading.measured}" for name, reading in columns.items())
            problems = [Problem(f"{PLACE}.columns.{axis}", f"no sensor measures it: {measured_by}") for axis in unread]
        axes = [name for reading in columns.values() for name in reading.read.names]
        if len(names) > 1 and not self.sensor_column and (problems or len(set(axes)) < len(axes)):
            text = f"missing: which of the tracker's sensors is it, {', '.join(map(repr, sensors))}?"
            problems = [Problem(f"{PLACE}.sensor", f"{text} `sensor_column` may tell, or columns that each has alone")]
        if problems:
            raise ConfigError(problems)
        return columns

    def read(
        self,
        path: TablePath,
        readings: Mapping[str, Reading],
        layout: Layout,
        refused: list[Problem],
        odd: list[str],
    ) -> tuple[dict[str, list[Sample[Look]]], Counter[str]]:
        """Return each sensor's scans in the order of time, and how many rows other sensors have, which are left out.

        What was refused is added to `refused`, and to `odd` that a clock was set back where rows are sorted.
        """
        axes = Space()
        try:
            for reading in readings.values():
                axes = axes.union(reading.read)
        except SpaceError as error:
            raise ConfigError.at(f"{PLACE}.columns", str(error)) from None
        by_axis = layout.columns(path, axes, self, PLACE)
        measured = {name: reading.measured for name, reading in readings.items()}
        absent = {name: reading.absent for name, reading in readings.items()}
        noises = noise_columns(self.noise, measured, absent, self.units, PLACE)
        wanted = {column.name: column.title for column in by_axis.values()} | self.wanted()
        for noise in noises.values():
            wanted |= noise.wanted
        told: dict[str, list[Sample[Cells]]] = {name: [] for name in readings}
        left_out: Counter[str] = Counter()
        by_sensor = {name: [by_axis[axis] for axis in reading.read.names] for name, reading in readings.items()}
        for row in rows(path, wanted, PLACE, layout.dialect, refused):
            try:
                sensor = row.cells["sensor_column"] if self.sensor_column else _filled(row, by_sensor)
                if sensor not in readings:
                    left_out[sensor] += 1
                    continue
                columns = by_sensor[sensor]
                blank = all(not row.cells[column.name] for column in columns)
                values, lacking = (None, list[str]()) if blank else _values(row, readings[sensor], columns)
                if values is not None:
                    check_place(readings[sensor].read, values, layout.origin)
                covariance = () if values is None else noises[sensor].read(row, lacking)
                own = row.cells.get("scan", ""), values, code_of_cell(row.cells.get("identity", "")), covariance
                sample = Sample(row.place, by_axis["time"].of(row), own)
            except ValueError as error:
                kind = BEYOND_PLANE if isinstance(error, BeyondPlane) else ""
                refused.append(Problem(row.place, str(error), kind=kind))
            else:
                told[sensor].append(sample)
        if layout.sort:
            for name, samples in told.items():
                odd += set_back(name, samples, [sample.value[2] for sample in samples])
        if self.scan:
            group = by_row if self.scan == BY_ROW else by_scan
        else:
            group = by_time if self.turn is None else partial(by_turn, self.turn)
        placed = {name: _placed(samples, readings[name], layout) for name, samples in told.items()}
        return {name: group(samples, refused, layout.sort) for name, samples in placed.items()}, left_out


def _filled(row: Row, by_sensor: Mapping[str, Sequence[Column]]) -> str:
    """Return the sensor whose columns a row fills, or the only one; ValueError unless it is one."""
    if len(by_sensor) == 1:
        return next(iter(by_sensor))
    filled = [name for name, columns in by_sensor.items() if any(row.cells[column.name] for column in columns)]
    if len(filled) != 1:
        names = ", ".join(map(repr, by_sensor))
        raise ValueError(f"must fill the columns of one of {names}, fills those of {' and '.join(filled) or 'none'}")
    return filled[0]


def _values(row: Row, reading: Reading, columns: Sequence[Column]) -> tuple[tuple[float, ...], list[str]]:
    """Return a row's values over the axes read, NaN in empty cells, and the measured axes that it lacks for these.

    ValueError for a cell that is no number, and for an empty one of what is always reported.
    """
    empty = [axis for axis, column in zip(reading.read.names, columns, strict=True) if not row.cells[column.name]]
    if not empty:
        return tuple(column.of(row) for column in columns), list(reading.absent)
    values, lacking = [], dict.fromkeys(reading.absent)
    for axis, column in zip(reading.read.names, columns, strict=True):
        if axis in empty and axis not in reading.gaps:
            told = f"{column.title} must be a number, got ''; name another column"
            raise ValueError(f"{told}, or wrap the sensor in 'partial' if its returns may lack {axis}")
        values.append(nan if axis in empty else column.of(row))
        lacking |= dict.fromkeys(reading.gaps[axis] if axis in empty else ())
    return tuple(values), list(lacking)


def _placed(rows: list[Sample[Cells]], reading: Reading, layout: Layout) -> list[Sample[Cells]]:
    """Return the rows over `reading.placed`."""
    if reading.placed == reading.read:
        return rows
    values = [row.value[1] for row in rows if row.value[1] is not None]
    placed = into_plane(reading.read, values, layout.origin, layout.frame).tolist()
    made = iter([[nan if isnan(one) else one for one in row] for row in placed] if reading.gaps else placed)
    return [
        row if row.value[1] is None else evolve(row, value=(row.value[0], tuple(next(made)), *row.value[2:])) for row in rows
    ]
