"""A data frame of named positions, smoothed: `vedette.smooth_positions`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import kernels
from vedette.errors import InputError
from vedette.space import Array, Indices, Mask
from vedette.units import in_unit
from vedette_files import NAMELESS
from vedette_files.libraries import needed
from vedette_files.tables.columnar import FrameTable, frame_of
from vedette_tools.smoothing.cells import GROSS, PIECE, as_before, written
from vedette_tools.smoothing.cleaning import gaps
from vedette_tools.smoothing.columns import Column, Columns, check_titles
from vedette_tools.smoothing.faults import first_fault
from vedette_tools.smoothing.noises import Model
from vedette_tools.smoothing.paths import Paths, edges_of
from vedette_tools.smoothing.plane import Plane
from vedette_tools.smoothing.several_objects import check_apart, mixed
from vedette_tools.smoothing.smoother import sampled, smoothed

MOST_ROWS = 50_000_000
"""Rows that resampling may make of one table: an interval in the wrong unit would make any number."""


@frozen(eq=False)
class Reports:
    """The rows of a frame that have a name and a time, sorted by both: their numbers, and what they report.

    codes: the object of each, from 0; plane: where its positions lie, for latitudes and longitudes; own (o,): the deviation
    in
    m of what the digits of each object leave out, NaN where they do not tell it; rounding: what they leave out at least.
    """

    rows: Indices
    codes: Indices
    paths: Paths
    plane: Plane | None
    own: Array
    rounding: float

    def roundings(self, least: float) -> Array:
        """Return what digits leave out of each object (o,), `least` where its own do not tell it."""
        return np.where(np.isnan(self.own), least, self.own)

    @property
    def objects(self) -> Indices:
        """Whose each piece is."""
        return self.codes[self.paths.starts[:-1]]

    @classmethod
    def of(cls, frame: Any, columns: Columns, gap: float | None = None) -> Reports:
        """Read a frame; gap: the longest time in s without a report within a piece, by default each object's own."""
        times = columns.times(frame)
        codes = _codes(frame[columns.name]) if columns.name else np.zeros(len(frame), dtype=int)
        good = np.flatnonzero(np.isfinite(times) & (codes >= 0) & ~columns.of_others(frame))
        rows = good[np.lexsort((times[good], codes[good]))]
        codes, times = np.unique(codes[rows], return_inverse=True)[1], times[rows]
        frame = _in_order(frame, rows)
        places, told = columns.positions(frame)
        velocities = columns.velocities(frame)
        own = np.full(len(np.unique(codes)), np.nan)
        of_told, rounding = columns.roundings(places[told], np.unique(codes[told], return_inverse=True)[1])
        own[np.unique(codes[told])] = of_told
        plane = None
        if columns.geodetic and len(rows):
            plane, steady = _plane(places, told, codes)
            places, velocities = plane.to_plane(steady, codes), plane.turned(velocities, steady[:, 0], codes)
        told &= ~_repeated(codes, times, places, velocities)
        places = np.where(told[:, None], places, 0.0)
        return cls(rows, codes, Paths(gaps(times, codes, told, gap), times, places, velocities, told), plane, own, rounding)


def smooth_positions(
    data: Any, by: str | None = None, every: float | str | None = None, gap: float | str | None = None
) -> Any:
    """Smooth the positions of many objects, each by itself, and return them in the same columns of a data frame.

    >>> smooth = vedette.smooth_positions(reports, by="mmsi", every="10 s")      # doctest: +SKIP

    Each object gets the noise and the agility that suit it; positions that cannot be right are marked as `gross`
    and not used, and long gaps split a path into pieces. Speeds and courses that the table reports are used as far as they
    prove right. Where it has none they are added, and so are the deviations of all.

    Parameters
    ----------
    data
        A data frame of pandas, or columns or rows by name; a row is a report of a time and a position.
    by
        The column that names objects; default: one whose title says so, as `mmsi`, else all rows are of one object.
    every
        How far apart positions are to be, in s or as "10 s"; default: at the times of the rows.
    gap
        The longest time without a report within a piece; default: 20 times the object's usual time between reports.

    Returns
    -------
    pandas.DataFrame
        In the order of the rows given; resampled ones by object and time. Rows without a time or a name are left out, and
        those of sensors that measure no positions; others without a position get one. Deviations are NaN where no piece
        has three reports, and of an object whose rows seem to be of several.

    Raises
    ------
    InputError
        If no column looks like a time or a position, if there is no column `by`, or if rows of one object are of several.
    """
    frame = frame_of(data)
    named = frame if all(name is None for name in frame.index.names) else frame.reset_index()
    titles = [str(title) for title in named.columns]
    named = named if titles == list(named.columns) else named.set_axis(titles, axis=1)
    check_titles(titles, "the data")
    table = FrameTable(named)
    columns = Columns.of(table, by, titles)
    longest = seconds("gap", gap)
    try:
        columns, model, reports = learned(named, columns, longest)
    except InputError as error:
        raise InputError(first_fault([table], columns) or str(error)) from None
    check_apart(reports.paths, reports.objects, columns.name, reports.roundings(reports.rounding), "the data", "by=COLUMN")
    smooth = smoothed_rows(named, columns, reports, model, reports.rounding, seconds("every", every))
    result = _with(_in_order(named, smooth.rows), smooth.cells)
    return result.reset_index(drop=True) if every is not None else _in_order(result, np.argsort(smooth.rows, kind="stable"))


def _in_order(frame: Any, rows: Indices) -> Any:
    """Return rows of a frame, itself if these are all as they stand: pandas copies them for some time."""
    return frame if np.array_equal(rows, np.arange(len(frame))) else frame.iloc[rows]


def _with(frame: Any, cells: Mapping[str, Any]) -> Any:
    """Return a frame with columns exchanged or added, all at once: one by one each takes a tenth of a millisecond."""
    pd = needed("pandas", "tables need pandas", "data")
    titles = dict.fromkeys([*frame.columns, *cells])
    every = {title: cells[title] if title in cells else frame[title].array.copy() for title in titles}
    return pd.DataFrame(every, index=frame.index, copy=False)


def learned(frame: Any, columns: Columns, gap: float | None) -> tuple[Columns, Model, Reports]:
    """Return the columns, with a speed's unit that was not stated, the model of a frame's objects, and its reports.

    InputError if it has no row with a time, a position and a name.
    """
    reports = Reports.of(frame, columns, gap)
    if not reports.paths.told.any():
        raise InputError("the data have no row with a time, a position and the name of an object")
    if columns.speed is not None and not columns.speed.stated:
        paths = reports.paths
        ahead = np.append(paths.waits[1:], 0.0)
        moved = np.append(np.linalg.norm(np.diff(paths.spots, axis=0), axis=-1), 0.0)
        both = paths.told & np.append(paths.told[1:], False) & (ahead > 0)
        steps = np.where(both, moved / np.where(ahead > 0, ahead, 1.0), np.nan)
        before = columns.speed.factor
        columns = columns.in_speed_unit(steps, columns.numbers(columns.speed, frame)[reports.rows])
        factor = (columns.speed or Column("")).factor / before
        reports = evolve(reports, paths=evolve(paths, velocities=factor * paths.velocities))
    return columns, sampled(reports.paths, reports.objects, reports.roundings(reports.rounding)), reports


def seconds(name: str, value: float | str | None) -> float | None:
    """Return a time in s, above 0; InputError for another."""
    try:
        seconds = None if value is None else in_unit(value, "s")
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if seconds is not None and not 0 < seconds < np.inf:
        raise InputError(f"{name}: must be a time above 0, got {value!r}")
    return seconds


@frozen(eq=False)
class Smoothed:
    """What smoothing writes, by object and time: cells by the titles of columns, the row of the frame (n,) that each comes
    from, whose it is (n,) and in which piece, the objects that seem to be several, of which nothing is claimed, and how many
    reports are gross.
    """

    cells: Mapping[str, Any]
    rows: Indices
    codes: Indices
    piece: Indices
    mixed: Indices
    gross: int


def smoothed_rows(
    frame: Any, columns: Columns, reports: Reports, model: Model, rounding: float, every: float | None
) -> Smoothed:
    """Return the smoothed rows of the reports of a frame, or those every so many s.

    rounding: what digits leave out at least, in m.
    """
    if every is not None and len(columns.of_time) > 1:
        raise InputError(
            f"every: writes a time to one column, and {columns.time.title} are several: write them to one first"
        )
    paths, objects = reports.paths, reports.objects
    rows = np.arange(len(paths))
    wider, asked, last = (paths, rows, rows) if every is None else _resampled(paths, every)
    floors = reports.roundings(rounding)
    smooth = smoothed(wider, objects, model, floors)
    several = mixed(wider, objects, smooth, floors)
    rows, codes, piece = reports.rows[last], reports.codes[last], smooth.piece[asked]
    piece = piece - np.searchsorted(smooth.objects, codes)
    claimed = np.isin(codes, several, invert=True) & model.told
    estimates = smooth.estimates.only(asked)
    # Errors of cut digits are no white ones: no number of reports tells more than these leave.
    estimates = evolve(estimates, spot_variances=np.maximum(estimates.spot_variances, floors[codes] ** 2))
    cells = written(columns, reports.plane, codes, estimates, claimed) | {PIECE: piece}
    if every is None:
        cells[GROSS] = smooth.gross
    else:
        cells[columns.time.title] = as_before(frame[columns.time.title], wider.times[asked], columns)
    return Smoothed(cells, rows, codes, piece, several, int(np.count_nonzero(smooth.gross)))


def _codes(names: Any) -> Indices:
    """Return a number for each name, in the order of the names as text; -1 for none."""
    pd = needed("pandas", "tables need pandas", "data")
    codes, every = pd.factorize(names)
    text = np.array([str(one) for one in every], dtype=str)
    number = np.where(np.isin(np.char.lower(text), NAMELESS), -1, np.unique(text, return_inverse=True)[1])
    return np.asarray(np.append(number, -1)[codes])


def _repeated(*columns: Array | Indices) -> Mask:
    """Return which rows say the same as the row before: sent or received twice, they tell nothing more."""
    same = np.zeros(len(columns[0]), dtype=bool)
    if len(same):
        same[1:] = np.all(
            [np.all((c[1:] == c[:-1]) | np.isnan(c[1:]), axis=tuple(range(1, c.ndim))) for c in columns], axis=0
        )
    return same


def _plane(places: Array, told: Mask, codes: Indices) -> tuple[Plane, Array]:
    """Return the plane of each object and its steady positions; a row without one is where the one before it is."""
    last = np.maximum.accumulate(np.where(told, np.arange(len(told)), 0))
    starts = edges_of(codes)
    first = starts[:-1][codes]
    later = np.minimum.accumulate(np.where(told, np.arange(len(told)), len(told))[::-1])[::-1]
    known = np.where((last >= first) & told[last], last, np.minimum(later, len(told) - 1))
    filled = np.where(told[known][:, None], places[known], 0.0)
    return Plane.of(filled, starts)


def _resampled(paths: Paths, every: float) -> tuple[Paths, Indices, Indices]:
    """Return the paths with rows at the multiples of a time within each piece, which rows these are, and the row of the
    paths before each.
    """
    first, last = paths.times[paths.starts[:-1]], paths.times[paths.starts[1:] - 1]
    low, high = np.ceil(first / every - 1e-9), np.floor(last / every + 1e-9)
    count = np.maximum(high - low + 1, 0).astype(int)
    if count.sum() > MOST_ROWS:
        raise InputError(f"every: {every:g} s makes {count.sum():,} rows, and at most {MOST_ROWS:,} are made")
    piece = np.repeat(np.arange(len(count)), count)
    step = kernels.counted(count)
    times = (low[piece] + step) * every
    n, whose = len(paths), paths.piece
    every_time, every_piece = np.concatenate([paths.times, times]), np.concatenate([whose, piece])
    asks = np.concatenate([np.zeros(n, dtype=bool), np.ones(len(times), dtype=bool)])
    order = np.lexsort((asks, every_time, every_piece))
    source = np.where(asks, 0, np.arange(len(asks)))[order]
    before = np.maximum.accumulate(source)
    nothing = np.zeros((len(times), 2))
    wider = Paths(
        np.searchsorted(every_piece[order], np.arange(len(count) + 1)),
        every_time[order],
        np.concatenate([paths.spots, nothing])[order],
        np.concatenate([paths.velocities, nothing * np.nan])[order],
        np.concatenate([paths.told, np.zeros(len(times), dtype=bool)])[order],
    )
    asked = np.flatnonzero(asks[order])
    return wider, asked, np.maximum(before[asked], paths.starts[:-1][piece])
