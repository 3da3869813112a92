"""Which columns of a table hold names, times, positions and velocities, and these as numbers."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence
from contextlib import suppress
from itertools import islice
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.errors import InputError
from vedette.space import Array, Indices, Mask
from vedette.units import in_unit
from vedette_files.libraries import needed
from vedette_files.tables.columnar import TablePath
from vedette_files.tables.composed import digits_of, joined, made_of
from vedette_files.tables.numbers import degrees
from vedette_files.tables.rows import Dialect, listed, rows
from vedette_tools.drafting.recognising import NO_WISHES, read_table
from vedette_tools.drafting.several import FLAT, GEODETIC
from vedette_tools.drafting.table import AID
from vedette_tools.drafting.titles import NAMES, UNITS, meaning
from vedette_tools.drafting.wishes import Wishes
from vedette_tools.smoothing.digits import roundings
from vedette_tools.smoothing.folders import folders

PACES = {"speed": ("groundspeed", "ground_speed", "gs"), "course": ("track", "true_track", "track_angle")}
"""Further titles of speeds and courses over ground, the words before a unit; of detections they may mean something else."""

UNKNOWN_SPEED, UNKNOWN_COURSE = 102.2 * 1852 / 3600, 360.0
"""m/s and deg: an AIS speed of 102.3 kn or a course of 360 deg says that it is not known."""

SPEED_UNITS = ("m/s", "kn", "km/h")
"""What a speed may be in that states no unit."""

MANY, REPEATED = 10_000, 1.5
"""A name is of objects if among so many rows it stands so often, or so many of its rows are of one time."""

METRES_PER_DEGREE = 111_000.0
"""Of latitude."""


@frozen
class Column:
    """A column's title, the factor to SI units, or to deg, and whether its title states the unit."""

    title: str
    factor: float = 1.0
    stated: bool = True


@frozen
class Columns:
    """The columns that smoothing reads and writes: positions as latitude and longitude, or along two axes of a plane.

    name: whose a row is, "" if all are of one; decimal: what numbers in text have before their decimals; dates: how dates
    are written, if not by ISO 8601; elsewhere: what rows of sensors hold that measure no positions, as ranges; assumed: what
    the time counts, if that is a guess; of_time: the columns that a time is read from, as of a date and a time of day.
    """

    name: str
    time: Column
    place: tuple[Column, Column]
    geodetic: bool
    north_first: bool = False
    speed: Column | None = None
    course: Column | None = None
    paces: tuple[Column, Column] | None = None
    decimal: str = "."
    dates: str = ""
    elsewhere: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
    of_time: tuple[str, ...] = ()

    @property
    def read(self) -> tuple[str, ...]:
        """The titles of all columns that are read."""
        columns = [*self.place, *(self.paces or ()), *(each for each in (self.speed, self.course) if each)]
        titles = [*([self.name] if self.name else []), *self.of_time, *(column.title for column in columns)]
        return tuple(dict.fromkeys(titles))

    @classmethod
    def of(cls, path: TablePath, by: str | None, titles: Sequence[str], wishes: Wishes = NO_WISHES) -> Columns:
        """Return the columns of a table with these titles; InputError if it lacks a time, a position, or the column `by`.

        wishes: which columns and units are stated.
        """
        table = read_table(path, AID, wishes)
        of_sensors = (table.measured, *table.others.values())
        measured = next((each for each in of_sensors if "range" not in each), None)
        if measured is None:
            raise InputError(f"{path}: ranges and bearings are no positions: track them, `vedette new config {path}`")
        elsewhere = tuple({title: None for each in of_sensors if "range" in each for title in each.values()})
        taken = {*measured.values(), *elsewhere, table.time.title}
        found = table.identity or _sure_name(titles) or next(iter(folders(path)), "")
        found = found or repeated_name(path, titles, table.time.title, taken, table.dialect)
        if table.apart and not found and by is None:
            near = f"rows of one {table.apart} lie near each other, rows that follow one another do not"
            cure = f"--by {table.apart} (by={table.apart!r}) smooths each by itself; if all are one's, leave the column out"
            raise InputError(f"{path}: {near}: these are several objects; {cure}")
        name = found if by is None else _title(path, by, titles)
        first, second = (axis for axis in measured if axis in (*GEODETIC, *FLAT))
        geodetic = first in GEODETIC
        place = tuple(
            Column(measured[axis], _factor(table.units.get(axis, ""), "deg" if geodetic else "m"))
            for axis in (first, second)
        )
        time = Column(table.time.title, _factor(table.time_unit, "s"))
        decimal, dates = table.dialect.decimal, table.dates
        assumed = tuple(guess for guess in table.assumed if guess.startswith(f"{time.title} counts "))
        columns = cls(
            name,
            time,
            (place[0], place[1]),
            geodetic,
            decimal=decimal,
            dates=dates,
            elsewhere=elsewhere,
            assumed=assumed,
            of_time=made_of(time.title, titles),
        )
        if made := next((title for title in columns.read if title not in titles), ""):
            raise InputError(
                f"{path}: {made} is no column by itself: smoothing reads each coordinate from one column; "
                "write them to columns of their own first"
            )
        north = {each.axis for each in map(meaning, (column.title for column in place))} == {"north", "east"}
        columns = evolve(columns, north_first=geodetic or (north and meaning(place[0].title).axis == "north"))
        return _paced(columns, titles)

    def in_speed_unit(self, steps: Array, speeds: Array) -> Columns:
        """Return the columns with the unit of a speed that its title does not state: that in which the `speeds` (n,) of
        reports, as numbers, fit the speeds (n,) in m/s of the `steps` to the next ones.
        """
        if self.speed is None or self.speed.stated:
            return self
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = steps / speeds
        moves = (steps > 1.0) & (speeds > 1.0) & np.isfinite(ratio)
        if not moves.any():
            return self
        factors = [in_unit(f"1 {unit}", "m/s") for unit in SPEED_UNITS]
        nearest = min(factors, key=lambda factor: abs(np.log(float(np.median(ratio[moves])) / factor)))
        return evolve(self, speed=evolve(self.speed, factor=nearest))

    def numbers(self, column: Column, frame: Any) -> Array:
        """Return a column's numbers in SI units, or deg; NaN where it has none."""
        pd = needed("pandas", "tables need pandas", "data")
        cells = frame[column.title]
        if cells.dtype.kind in "iuf" and isinstance(cells.dtype, np.dtype):
            return np.asarray(cells, dtype=float) * column.factor
        if self.decimal == "," and not pd.api.types.is_numeric_dtype(cells):
            cells = cells.astype(str).str.replace(",", ".", regex=False)
        return np.asarray(pd.to_numeric(cells, errors="coerce"), dtype=float) * column.factor

    def _angles(self, column: Column, frame: Any) -> Array:
        """Return latitudes or longitudes in deg, also of text as 59 25.955 N; NaN where a cell is none."""
        values = self.numbers(column, frame)
        for row in np.flatnonzero(np.isnan(values)) if frame[column.title].dtype.kind not in "iuf" else ():
            with suppress(ValueError):
                values[row] = degrees(str(frame[column.title].iloc[row]))
        return values

    def time_cells(self, frame: Any) -> Any:
        """Return the cells of the time, joined where several columns hold it."""
        if self.time.title in frame:
            return frame[self.time.title]
        pd = needed("pandas", "tables need pandas", "data")
        digits = digits_of(self.of_time[-1]) if len(self.of_time) < 4 else 0
        several = zip(*(frame[title].astype("string").fillna("") for title in self.of_time), strict=True)
        return pd.Series([joined(cells, digits) for cells in several], index=frame.index, dtype=object)

    def times(self, frame: Any) -> Array:
        """Return the times in s, since 1970 where they are dates; NaN where a cell is none."""
        pd = needed("pandas", "tables need pandas", "data")
        cells = self.time_cells(frame)
        if dated(cells):
            pattern = self.dates or "ISO8601"
            when = cells if _is_date(cells) else pd.to_datetime(cells, format=pattern, utc=True, errors="coerce")
            when = when if when.dt.tz is None else when.dt.tz_convert("UTC").dt.tz_localize(None)
            return np.asarray((when.to_numpy() - np.datetime64(0, "s")) / np.timedelta64(1, "s"), dtype=float)
        if cells.dtype.kind == "m":
            return np.asarray(cells.to_numpy() / np.timedelta64(1, "s"), dtype=float)
        return self.numbers(self.time, frame)

    def positions(self, frame: Any) -> tuple[Array, Mask]:
        """Return east and north (n, 2) in m, or longitude and latitude in deg, and which are positions."""
        read = self._angles if self.geodetic else self.numbers
        first, second = (read(column, frame) for column in self.place)
        values = np.stack([second, first] if self.north_first else [first, second], axis=-1)
        good = np.isfinite(values).all(axis=-1)
        if self.geodetic:
            with np.errstate(invalid="ignore"):
                good &= (np.abs(values[:, 1]) <= 90) & (np.abs(values[:, 0]) <= 360.0)
        return values, good

    def of_others(self, frame: Any) -> Mask:
        """Return which rows are of sensors that measure no positions: they hold what these measure, and no position."""
        measured = np.zeros(len(frame), dtype=bool)
        for title in self.elsewhere:
            measured |= np.isfinite(self.numbers(Column(title), frame))
        return measured & ~self.positions(frame)[1] if self.elsewhere else measured

    def roundings(self, places: Array, codes: Indices) -> tuple[Array, float]:
        """Return what digits leave out of positions (n, 2), as `positions` returns them, by `digits.roundings`."""
        factors = np.array([column.factor for column in self.place][:: -1 if self.north_first else 1])
        sizes = factors * (METRES_PER_DEGREE if self.geodetic else 1.0)
        return roundings(places / factors, codes, sizes, degrees=self.geodetic)

    def velocities(self, frame: Any) -> Array:
        """Return velocities (n, 2) to east and north in m/s; NaN where none is reported."""
        if self.paces is not None:
            first, second = (self.numbers(column, frame) for column in self.paces)
            return np.stack([second, first] if self.north_first and not self.geodetic else [first, second], axis=-1)
        if self.speed is None or self.course is None:
            return np.full((len(frame), 2), np.nan)
        speed, course = self.numbers(self.speed, frame), self.numbers(self.course, frame)
        with np.errstate(invalid="ignore"):
            unknown = (speed < 0) | (speed > UNKNOWN_SPEED) & (course >= UNKNOWN_COURSE) | (course >= UNKNOWN_COURSE)
        angle = np.radians(np.where(unknown, np.nan, course))
        return np.stack([speed * np.sin(angle), speed * np.cos(angle)], axis=-1)


def check_titles(titles: Sequence[str], data: str) -> None:
    """Raise InputError if two columns have one title."""
    if twice := [title for i, title in enumerate(titles) if title in titles[:i]]:
        raise InputError(f"{data}: two columns are called {twice[0]!r}: rename one of them")


def dated(cells: Any) -> bool:
    """Return whether a column holds dates: as such, or as text of which most of the first cells are no numbers."""
    if _is_date(cells):
        return True
    if cells.dtype.kind in "ifubm":
        return False
    text = cells.dropna().astype(str)
    first = [cell.strip() for cell in text.head(100) if cell.strip()]
    return 2 * sum(re.fullmatch(r"[-+\d.,eE]+", cell) is None for cell in first) > len(first)


def _is_date(cells: Any) -> bool:
    pd = needed("pandas", "tables need pandas", "data")
    return bool(pd.api.types.is_datetime64_any_dtype(cells))


def _sure_name(titles: Sequence[str]) -> str:
    """Return the title that names objects whatever its cells hold; "" without one. A plain `id` may count rows."""
    words = {re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_"): title for title in titles}
    return next((words[name] for name in NAMES[: NAMES.index("id")] if name in words), "")


def repeated_name(path: TablePath, titles: Sequence[str], time: str, taken: Collection[str], dialect: Dialect) -> str:
    """Return the first title that may name objects or count rows and here names objects; "" without one.

    It does if its cells repeat, or if many rows are of one time, which those of one object are not.
    """
    words = {re.sub(r"[^a-z0-9]+", "_", title.lower()).strip("_"): title for title in titles if title not in taken}
    for name in NAMES:
        if name in words:
            wanted = {"time": time, "name": words[name]}
            given = [row.cells for row in islice(rows(path, wanted, "smooth", dialect, []), MANY)]
            told = [(cells["name"], cells["time"]) for cells in given if cells["name"]]
            names, times = (len(set(cells)) for cells in zip(*told, strict=True)) if told else (0, 0)
            if told and (REPEATED * names <= len(told) or REPEATED * times <= len(told)):
                return words[name]
    return ""


def _title(path: TablePath, by: str, titles: Sequence[str]) -> str:
    """Return the title that `by` means, in capitals or not."""
    named = [title for title in titles if title == by] or [title for title in titles if title.lower() == by.lower()]
    if len(named) != 1:
        raise InputError(f"{path}: there is no column {by!r}, which --by names; the columns are {listed(list(titles))}")
    return named[0]


def _factor(unit: str, to: str) -> float:
    return in_unit(unit if unit[:1].isdigit() else f"1 {unit}", to) if unit else 1.0


def _paced(columns: Columns, titles: Sequence[str]) -> Columns:
    """Return the columns with those of speed and course, or of velocities along the axes, if the table has them."""
    by_axis: dict[str, Column] = {}
    for title in sorted(titles, key=lambda title: not meaning(title).sure):
        axis, factor, stated = _pace(title)
        if axis and title not in columns.read:
            by_axis.setdefault(axis, Column(title, factor, stated))
    if {"veast", "vnorth"} <= by_axis.keys():
        east, north = by_axis["veast"], by_axis["vnorth"]
        return evolve(columns, paces=(north, east) if columns.north_first and not columns.geodetic else (east, north))
    if {"vx", "vy"} <= by_axis.keys() and not columns.geodetic:
        return evolve(columns, paces=(by_axis["vx"], by_axis["vy"]))
    return evolve(columns, speed=by_axis.get("speed"), course=by_axis.get("course"))


def _pace(title: str) -> tuple[str, float, bool]:
    """Return the axis of a velocity that a title means, "" if none, its factor to m/s or deg, and whether it is stated."""
    said = meaning(title)
    axis, unit = said.axis, said.unit
    words = re.sub(r"[^a-z]+", "_", title.lower()).strip("_")
    for name, others in PACES.items():
        for other in others:
            if words == other or words.startswith(f"{other}_"):
                rest = words.removeprefix(other).strip("_").replace("_", "/")
                known = UNITS["m/s" if name == "speed" else "rad"]
                if not rest or rest in known or rest.replace("/", "") in known:
                    axis, unit = name, known.get(rest, known.get(rest.replace("/", ""), ""))
    if axis == "course":
        return axis, float(np.degrees(_factor(unit, "rad"))) if unit else 1.0, bool(unit)
    if axis not in ("speed", "vx", "vy", "veast", "vnorth"):
        return "", 1.0, True
    return axis, _factor(unit, "m/s"), bool(unit)
