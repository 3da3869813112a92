"""Recordings in CSV files with named columns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.errors import InputError, Problem
from vedette.io.csv_returns import DetectionColumns, Look, Reading
from vedette.io.csv_truth import Platform, PlatformColumns, TruthColumns
from vedette.io.gaps import fill_gaps
from vedette.io.opening import shown
from vedette.io.reading import (
    FRAMES,
    NORTH_EAST,
    Sample,
    beyond_period,
    check_files,
    detections,
    find,
    offer_sorting,
    offers_first,
    polar,
)
from vedette.roles import Sensor
from vedette.supporting import Source
from vedette.types import Recording, Rows, Scan, Trajectory


@final
@frozen
class CsvSource(Source):
    """Detections from a CSV file with a header line, optionally with files of the truth and of the platform's positions.

    x and y become range and bearing if the tracker's sensor measures these and the platform is given. A row whose
    measured cells are all empty says that its scan holds no return. Bad rows are refused, one by one.
    """

    kind: ClassVar[str] = "csv"
    draws: ClassVar[bool] = False

    detections: DetectionColumns = fields.part("the returns")
    path: str = fields.text("folder of the recording, or its one file", default="")
    about: str = fields.text("what the recording is and who published it, told to those who lack it", default="")
    truth: TruthColumns | None = fields.part("the true states, if they are known", default=None)
    platform: PlatformColumns | None = fields.part("the sensors' platform, if it moves", default=None)
    frame: str = fields.choice("where the axes point", FRAMES, default=FRAMES[0])
    delimiter: str = fields.choice("between columns", [",", ";", "\t", "|"], default=",")
    sort: bool = fields.flag("sort all rows by time; default: those that go back in time are refused", default=False)

    def __attrs_post_init__(self) -> None:
        if self.platform is not None and self.platform.scan and not self.detections.scan:
            raise ValueError("platform.scan: needs the detections' `scan` column too")

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans in time order, those of one time in the tracker's order of sensors.

        InputError for a file that is missing, empty, lacks a column or has no good row. ConfigError for columns that
        are not what the sensors measure.
        """
        readings = self.detections.readings(sensors, self.platform is not None)
        given = find(self.path, self._wanted())
        folder, path = (given, given / self.detections.file) if self.detections.file else (given.parent, given)
        named = [(f"{place}.file", table.file) for place, table in self._tables().items() if table.file]
        check_files(folder, named, self._wanted())
        refused: dict[str, list[Problem]] = {"platform": [], "detections": [], "truth": []}
        rows: dict[str, Rows] = {}
        notes = {"recording": self.about} if self.about else {}
        if self.frame == NORTH_EAST:
            notes["frame"] = self.frame
        platform = None
        if self.platform is not None:
            file = folder / self.platform.file if self.platform.file else path
            platform = self.platform.read(file, self.delimiter, refused["platform"], sort=self.sort)
            rows["platform"] = _rows(platform.rows, refused["platform"])
        looks, left_out = self.detections.read(path, readings, self.delimiter, refused["detections"], sort=self.sort)
        notes |= {f"rows of {shown(sensor)}, which the tracker lacks": str(count) for sensor, count in left_out.items()}
        used, scans, odd = 0, [], list[str]()
        for name, reading in readings.items():
            odd += _odd(name, reading, looks[name])
            placed = []
            for look in looks[name]:
                scan = _scan(name, look, reading, platform, refused["detections"])
                if scan is not None:
                    used += look.rows
                    placed.append(scan)
            if name in self.detections.periods:
                filled = fill_gaps(placed, self.detections.periods[name])
                notes[f"scans of {name} without returns supposed in gaps"] = str(len(filled) - len(placed))
                placed = filled
            scans += placed
        if not scans:
            told = [problem for problems in refused.values() for problem in problems]
            first = f"; the first problem: {told[0]}" if told else ""
            raise InputError(f"{path}: holds no usable scan of {', '.join(readings)}{first}")
        rows["detections"] = _rows(used, refused["detections"], left_out.total())
        truth: tuple[Trajectory, ...] = ()
        if self.truth is not None:
            truth = self.truth.read(folder, self.delimiter, refused["truth"], sort=self.sort)
            rows["truth"] = _rows(sum(len(path.times) for path in truth), refused["truth"])
        told = offers_first(offer_sorting(refused[name], part.total) for name, part in rows.items())
        in_order = tuple(sorted(scans, key=lambda scan: scan.time))
        return Recording(in_order, truth, tuple(dict.fromkeys(told)), notes, tuple(odd), rows=rows)

    def _tables(self) -> dict[str, DetectionColumns | TruthColumns | PlatformColumns]:
        """Return the config's tables that name columns, by their names."""
        named = {"detections": self.detections, "truth": self.truth, "platform": self.platform}
        return {name: table for name, table in named.items() if table is not None}

    def _wanted(self) -> str:
        """Describe what a user who lacks the recording must obtain, and in which format."""
        files: dict[str, list[str]] = {}
        for table in self._tables().values():
            titles = [*table.wanted().values(), *table.columns.values()]
            files.setdefault(table.file or self.detections.file or "a file", []).extend(titles)
        listed = [f"{name} with columns {', '.join(dict.fromkeys(titles))}" for name, titles in files.items()]
        return f"{self.about or 'a recording'}. Format: CSV, {'; '.join(listed)}"


def _rows(used: int, refused: list[Problem], left_out: int = 0) -> Rows:
    lost = sum(problem.rows for problem in refused)
    return Rows(used + lost + left_out, used, lost, left_out)


def _odd(name: str, reading: Reading, looks: list[Sample[Look]]) -> Iterator[str]:
    """Yield the angles that are larger than a whole turn, in words; the scans wrap them."""
    values = [np.array(look.value.returns).reshape(-1, len(reading.read)) for look in looks]
    for i, axis in enumerate(reading.read.axes):
        if axis.period is not None and values:
            said = beyond_period(name, axis, np.concatenate(values)[:, i])
            if said is not None:
                yield said


def _scan(name: str, look: Sample[Look], reading: Reading, platform: Platform | None, refused: list[Problem]) -> Scan | None:
    """Return a scan with its pose; None, and refused, if the platform moves and its pose is unknown."""
    pose = None
    if platform is not None:
        pose = platform.pose(look.value.scan, look.time)
        if pose is None:
            text = f"the recording does not say where the platform was at {look.time!r} s"
            refused.append(Problem(look.place, text, look.rows))
            return None
    values = np.array(look.value.returns).reshape(-1, len(reading.read)).T
    found = dict(zip(reading.read.names, values, strict=True))
    if reading.relative and pose is not None:
        x, y = pose.position
        found = polar(found["x"] - x, found["y"] - y, float(pose.heading))
    return Scan(look.time, name, detections(found, reading.measured), pose)
