"""Recordings in tables with named columns: CSV files, Parquet files, data frames."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import InputError, Problem, Recording, Rows, Scan, Sensor, Source, Trajectory, fields
from vedette_files.apart import Apart, ApartTable
from vedette_files.geodesy import FAR, RADIUS, Origin, off_by
from vedette_files.georeference import NAMED
from vedette_files.input_files import shown, user_path
from vedette_files.oddities import held_positions, odd_returns, replaced, set_forward
from vedette_files.readers import (
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
from vedette_files.tables.columnar import PARQUET, SUFFIX, FrameTable, TablePath
from vedette_files.tables.empty_scans import fill_gaps
from vedette_files.tables.layout import Layout
from vedette_files.tables.looks import Look
from vedette_files.tables.platform import PlatformColumns, Platforms
from vedette_files.tables.returns import POSITION, DetectionColumns, Reading
from vedette_files.tables.rows import BY_ROW, Dialect
from vedette_files.tables.times import DATED, UNZONED, check_pattern
from vedette_files.tables.truth import TruthColumns


@final
@frozen
class CsvSource(Source):
    """Detections from a CSV file with a header line, a Parquet file, JSON records or GPX; truth and platforms if given.

    x and y become range and bearing if the tracker's sensor measures these and the platform is given. A row whose
    measured cells are all empty says that its scan holds no return. Bad rows are refused, one by one. Times are numbers,
    dates and times by ISO 8601, or times of day. Latitudes and longitudes on WGS 84 become x and y around the origin.
    """

    kind: ClassVar[str] = "csv"
    draws: ClassVar[bool] = False

    detections: DetectionColumns = fields.part("the returns")
    path: str = fields.text("folder of the recording, or its one file", default="")
    about: str = fields.text("what the recording is and who published it, told to those who lack it", default="")
    truth: TruthColumns | None = fields.part("the true states, if they are known", default=None)
    platform: PlatformColumns | None = fields.part("the sensors' platforms, if they move", default=None)
    frame: str = fields.choice("where the axes point", FRAMES, default=FRAMES[0])
    origin: Origin | None = fields.part(
        "where x and y are 0, for latitudes and longitudes; default: the middle of the platform's, else of the returns'",
        default=None,
    )
    delimiter: str = fields.choice("between columns; one blank stands for any", [",", ";", "\t", "|", " "], default=",")
    decimal: str = fields.choice("in numbers", [".", ","], default=".")
    dates: str = fields.text("how dates are written, as '%d/%m/%Y %H:%M:%S'; default: by ISO 8601", default="")
    sort: bool = fields.flag("sort all rows by time; default: those that go back in time are refused", default=False)
    apart: Apart | None = fields.part(
        "limits of a process of its own that decodes Parquet files; default: none, this process decodes", default=None
    )

    def __attrs_post_init__(self) -> None:
        if self.platform is not None and self.platform.scan and self.detections.scan in ("", BY_ROW):
            raise ValueError("platform.scan: needs the detections' `scan` column too")
        if self.dates:
            check_pattern(self.dates)

    def open(self, sensors: Mapping[str, Sensor], rng: np.random.Generator) -> Recording:
        """Return all scans in time order, those of one time in the tracker's order of sensors.

        InputError for a file that is missing, empty, lacks a column or has no good row. ConfigError for columns that
        are not what the sensors measure.
        """
        self.detections.readings(sensors, self.platform is not None)
        given = find(self.path, self._wanted())
        folder, path = (given, given / self.detections.file) if self.detections.file else (given.parent, given)
        named = [(f"{place}.file", table.file) for place, table in self._tables().items() if table.file]
        check_files(folder, named, self._wanted())
        return self._read(folder, path, sensors)

    def open_frame(self, frame: Any, sensors: Mapping[str, Sensor]) -> Recording:
        """Return what `open` does, with a data frame of pandas in the place of the detections' file.

        Other files, of the truth and of the platform, lie in the folder `path`, or in the current one.
        """
        folder = user_path(self.path) if self.path else Path()
        return self._read(folder if folder.is_dir() else folder.parent, FrameTable(frame), sensors)

    def _decoded(self, path: TablePath) -> TablePath:
        """Return a table, to be decoded where `apart` says."""
        if self.apart is None or not isinstance(path, Path) or path.suffix.lower() != SUFFIX:
            return path
        return ApartTable(path, self.apart)

    def _read(self, folder: Path, path: TablePath, sensors: Mapping[str, Sensor]) -> Recording:
        readings = self.detections.readings(sensors, self.platform is not None)
        refused: dict[str, list[Problem]] = {"platform": [], "detections": [], "truth": []}
        rows: dict[str, Rows] = {}
        notes = {"recording": self.about} if self.about else {}
        if self.frame == NORTH_EAST:
            notes["frame"] = self.frame
        if not isinstance(path, Path) or path.suffix.lower() == SUFFIX:
            notes["table"] = PARQUET
        path = self._decoded(path)
        paths: dict[str, TablePath] = {
            place: self._decoded(folder / table.file) if table.file and place != "detections" else path
            for place, table in self._tables().items()
        }
        if self.detections.identity:
            notes[NAMED] = f"by the column {self.detections.identity}"
        layout, told = self._layout(paths)
        notes |= told
        platform, odd = None, list[str]()
        if self.platform is not None:
            platform = self.platform.read(paths["platform"], layout, refused["platform"])
            platform.check(readings)
            rows["platform"] = _rows(platform.used, refused["platform"], platform.left_out)
        looks, left_out = self.detections.read(path, readings, layout, refused["detections"], odd)
        notes |= {f"rows of {shown(sensor)}, which the tracker lacks": str(count) for sensor, count in left_out.items()}
        if platform is not None:
            platform = platform.timed({look.value.scan: look.time for every in looks.values() for look in every})
        used, scans, named = 0, list[Scan](), bool(self.detections.identity)
        for name, reading in readings.items():
            odd += [*_odd(name, reading, looks[name], self.detections.units), *_far(name, reading, looks[name], layout)]
            made = [_scan(name, look, reading, platform, refused["detections"], named=named) for look in looks[name]]
            used += sum(look.rows for look, scan in zip(looks[name], made, strict=True) if scan is not None)
            placed = [scan for scan in made if scan is not None]
            if name in self.detections.periods:
                filled = fill_gaps(placed, self.detections.periods[name])
                notes[f"scans of {name} without returns supposed in gaps"] = str(len(filled) - len(placed))
                placed = filled
            scans += placed
        if not scans:
            lost = [problem for problems in refused.values() for problem in problems]
            first = f"; the first problem: {lost[0]}" if lost else ""
            raise InputError(f"{path}: holds no usable scan of {', '.join(readings)}{first}")
        rows["detections"] = _rows(used, refused["detections"], left_out.total())
        truth: tuple[Trajectory, ...] = ()
        if self.truth is not None:
            truth = self.truth.read(folder, layout, refused["truth"])
            rows["truth"] = _rows(sum(len(path.times) for path in truth), refused["truth"])
        problems = offers_first(offer_sorting(refused[name], part.total) for name, part in rows.items())
        in_order = tuple(sorted(scans, key=lambda scan: scan.time))
        cure = "if it is there on its platform, write them into [source.platform.mounted.{}]"
        odd += replaced(sensors, in_order, cure)
        odd += _early(in_order, moving=platform is not None)
        odd += set_forward([scan.time for scan in in_order]) if "time zone" in notes else ()
        return Recording(in_order, truth, tuple(dict.fromkeys(problems)), notes, tuple(odd), rows=rows)

    def _layout(self, paths: Mapping[str, TablePath]) -> tuple[Layout, dict[str, str]]:
        """Return what holds of all tables, and notes about it: the origin on the earth, the dates that times are."""
        layout = Layout(Dialect(self.delimiter, self.decimal), self.sort, self.frame, dates=self.dates)
        notes, tables = dict[str, str](), self._tables()
        form = layout.form(paths["detections"], self.detections, "detections")
        if form.dated:
            notes["time"] = DATED
        if form.name == UNZONED:
            notes["time zone"] = "the times state none: taken as UTC"
        origin = self.origin
        for place in ("platform", "detections", "truth"):
            if origin is None and place in tables and "latitude" in tables[place].columns:
                origin = layout.middle(paths[place], tables[place], place)
        if origin is not None:
            notes["origin"] = str(origin)
        return evolve(layout, origin=origin, first=form.first), notes

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
        form = PARQUET if (self.detections.file or self.path).endswith(SUFFIX) else "CSV"
        return f"{self.about or 'a recording'}. Format: {form}, {'; '.join(listed)}"


def _rows(used: int, refused: list[Problem], left_out: int = 0) -> Rows:
    lost = sum(problem.rows for problem in refused)
    return Rows(used + lost + left_out, used, lost, left_out)


def _odd(name: str, reading: Reading, looks: list[Sample[Look]], units: Mapping[str, str]) -> Iterator[str]:
    """Yield in words the angles that are larger than a whole turn, which the scans wrap, and what no sensor sends."""
    z = np.array([each for look in looks for each in look.value.returns], dtype=float).reshape(-1, len(reading.placed))
    of = np.repeat(np.arange(len(looks)), [len(look.value.returns) for look in looks])
    for axis, column in zip(reading.placed.axes, z.T, strict=True):
        if (said := beyond_period(name, axis, column, units.get(axis.name, ""))) is not None:
            yield said
    codes = np.array([code for look in looks for code in look.value.codes], dtype=int)
    if len(codes) == len(z):
        where = [i for i, axis in enumerate(reading.placed.axes) if axis.name in POSITION]
        yield from held_positions(name, z[:, where] if where else z, codes, of)
    yield from odd_returns(name, reading.placed, z, of, named=bool(np.any(codes >= 0)))


def _far(name: str, reading: Reading, looks: list[Sample[Look]], layout: Layout) -> Iterator[str]:
    """Yield a sentence if latitudes and longitudes are too far from the origin for one plane."""
    if layout.origin is None or "latitude" not in reading.read or not looks:
        return
    where = reading.placed.locate(POSITION)
    values = np.concatenate([np.array(look.value.returns).reshape(-1, len(reading.placed))[:, where] for look in looks])
    shadow = float(np.max(np.hypot(*values.T), initial=0.0))  # of the ground on the plane
    largest = RADIUS * float(np.arcsin(min(shadow / RADIUS, 1.0)))
    if largest > FAR:
        yield (
            f"{name}: positions are up to {largest / 1e3:,.0f} km from the origin {layout.origin}: distances in the "
            f"plane are off by {100 * off_by(largest):.2g} % there, and by more than 0.02 % beyond {FAR / 1e3:.0f} km"
        )


def _early(scans: Sequence[Scan], *, moving: bool) -> Iterator[str]:
    """Yield a sentence where returns with times of their own are taken at other times, or from another place."""
    early, before = 0, -np.inf
    for scan in scans:
        if scan.detections.time is not None:
            early += int(np.count_nonzero(scan.detections.time < before))
            if moving and scan.pose is not None:
                yield f"{scan.sensor}: the platform moves: the returns of a turn are taken from where it was at the last"
                moving = False
        before = scan.time
    if early:
        yield f"{early} returns are of before the scan before theirs, as sensors' turns overlap: they are taken at its time"


def _scan(
    name: str, look: Sample[Look], reading: Reading, platform: Platforms | None, refused: list[Problem], *, named: bool
) -> Scan | None:
    """Return a scan with its pose; None, and refused, if the platform moves and its pose is unknown."""
    pose = None
    if platform is not None and platform.moves(name):
        pose = platform.pose(name, look.value.scan, look.time)
        if pose is None:
            text = f"the recording does not say where the platform was at {look.time!r} s{platform.between}"
            refused.append(Problem(look.place, text, look.rows))
            return None
    values = np.array(look.value.returns).reshape(-1, len(reading.placed)).T
    measured = dict(zip(reading.placed.names, values, strict=True))
    measured |= {name: np.full(len(look.value.returns), np.nan) for name in reading.absent}
    if reading.relative and pose is not None:
        x, y = pose.position[:2]
        measured = polar(measured["x"] - x, measured["y"] - y, float(pose.heading))
    seen = detections(measured, reading.measured)
    seen = evolve(seen, identity=np.array(look.value.codes, dtype=int)) if named else seen
    if look.value.noises:
        m = len(reading.measured)
        seen = evolve(seen, noise=np.array(look.value.noises).reshape(-1, m, m))
    return Scan(look.time, name, evolve(seen, time=np.array(look.value.times)) if look.value.times else seen, pose)
