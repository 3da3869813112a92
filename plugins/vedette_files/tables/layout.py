"""What holds of all tables of a recording, and the columns of one of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Protocol

import numpy as np
from attrs import frozen

from vedette import Axis, ConfigError, Problem, Space
from vedette_files.geodesy import COURSE, GEODETIC, Origin, axes_read
from vedette_files.readers import FRAMES
from vedette_files.tables.columnar import TablePath
from vedette_files.tables.numbers import Number, Row, numbers
from vedette_files.tables.rows import COMMAS, Dialect, rows
from vedette_files.tables.times import NUMBER, Form, Times, form_of


class Column(Protocol):
    """A column that is read: its name in the config, its title in the file."""

    @property
    def name(self) -> str: ...

    @property
    def title(self) -> str: ...

    def of(self, row: Row) -> float: ...


class Named(Protocol):
    """A config's table that names columns."""

    @property
    def time(self) -> str: ...

    @property
    def columns(self) -> dict[str, str]: ...

    @property
    def units(self) -> dict[str, str]: ...


@frozen
class Layout:
    """What holds of all tables: their dialect, whether rows are sorted, where x and y point, the origin on the earth.

    `first` is the first time of the detections in s: times of day lie near it. `dates`: how dates are written, if not by
    ISO 8601.
    """

    dialect: Dialect = COMMAS
    sort: bool = False
    frame: str = FRAMES[0]
    origin: Origin | None = None
    first: float = 0.0
    dates: str = ""

    def columns(self, path: TablePath, read: Space, table: Named, place: str) -> dict[str, Column]:
        """Return a column for each axis that is read, and for the time if the table has one."""
        columns: dict[str, Column] = dict(numbers(read, table.time, table.columns, table.units, place))
        time = columns.get("time")
        if isinstance(time, Number):
            columns["time"] = Times(time, self.form(path, table, place), self.first)
        return columns

    def form(self, path: TablePath, table: Named, place: str) -> Form:
        """Return the form of a table's times: numbers if they have a unit, else what most of the first are."""
        if not table.time or "time" in table.units:
            return Form(NUMBER)
        return form_of((row.cells["time"] for row in rows(path, {"time": table.time}, place, self.dialect, [])), self.dates)

    def middle(self, path: TablePath, table: Named, place: str) -> Origin:
        """Return the middle of the table's latitudes and longitudes."""
        pair = Space(GEODETIC.axes[:2])
        by_axis = numbers(pair, "", table.columns, {n: u for n, u in table.units.items() if n in pair}, place)
        wanted = {column.name: column.title for column in by_axis.values()}
        given = rows(path, wanted, place, self.dialect, [])
        positions = [spot for row in given if (spot := _numbers(by_axis, row)) is not None]
        return Origin.among(np.array(positions).reshape(-1, 2))


def _numbers(by_axis: Mapping[str, Number], row: Row) -> tuple[float, ...] | None:
    try:
        return tuple(column.of(row) for column in by_axis.values())
    except ValueError:
        return None


def chosen(columns: Mapping[str, str], known: Space, place: str) -> Space:
    """Return the axes of a file that give those of `known` which `columns` names, in their order; ConfigError for others."""
    read = with_altitude(axes_read(known, columns)[0], columns)
    problems = [
        Problem(f"{place}.columns.{name}", f"unknown axis; those are {', '.join(_names(known))}")
        for name in columns
        if name not in read
    ]
    if problems:
        raise ConfigError(problems)
    return read


def with_altitude(read: Space, columns: Mapping[str, str]) -> Space:
    """Return the axes with the altitude, if it goes with latitudes that are read."""
    lacks = "altitude" in columns and "latitude" in read and "altitude" not in read
    return Space((*read.axes, *_ALTITUDE)) if lacks else read


_ALTITUDE: tuple[Axis, ...] = GEODETIC.axes[2:]


def _names(known: Space) -> Iterator[str]:
    yield from known.names
    yield from (*GEODETIC.names, *COURSE.names)
