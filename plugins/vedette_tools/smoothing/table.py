"""A data frame of named positions, smoothed: `vedette.smooth_positions`."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette.errors import InputError
from vedette.space import Array, Indices, Mask
from vedette.units import in_unit
from vedette_files.columnar import FrameTable, frame_of
from vedette_files.libraries import needed
from vedette_tools.smoothing.cleaning import gaps
from vedette_tools.smoothing.columns import Columns, dated
from vedette_tools.smoothing.noises import Model
from vedette_tools.smoothing.paths import Paths
from vedette_tools.smoothing.plane import Plane
from vedette_tools.smoothing.several_objects import check_apart
from vedette_tools.smoothing.smoother import Smooth, sampled, smoothed

DEVIATIONS = ("position_deviation_m", "speed_deviation_mps", "course_deviation_deg")
"""The columns of deviations: of a position and of a speed along an axis, and of a course."""

PIECE, GROSS = "piece", "gross"
"""The columns that number an object's unbroken stretches, and mark positions that were taken to be wrong."""

SPEED, COURSE = "speed_mps", "course_deg"
"""The columns of speeds and courses in tables that have none."""

MOST_ROWS = 50_000_000
"""Rows that resampling may make of one table: an interval in the wrong unit would make any number."""


@frozen(eq=False)
class Reports:
    """The rows of a frame that have a name and a time, sorted by both: their numbers, and what they report.

    codes: the object of each, from 0; plane: where its positions lie, for latitudes and longitudes.
    """

    rows: Indices
    codes: Indices
    paths: Paths
    plane: Plane | None

    @property
    def objects(self) -> Indices:
        """Whose each piece is."""
        return self.codes[self.paths.starts[:-1]]

    @classmethod
    def of(cls, frame: Any, columns: Columns, gap: float | None = None) -> Reports:
        """Read a frame; gap: the longest time in s without a report within a piece, by default each object's own."""
        pd = needed("pandas", "tables need pandas", "data")
        times = columns.times(frame)
        names = frame[columns.name] if columns.name else pd.Series(np.zeros(len(frame), dtype=int))
        codes = np.asarray(pd.factorize(names.astype(str).where(names.notna() & (names.astype(str) != "")), sort=True)[0])
        good = np.flatnonzero(np.isfinite(times) & (codes >= 0) & ~columns.of_others(frame))
        rows = good[np.lexsort((times[good], codes[good]))]
        codes, times = np.unique(codes[rows], return_inverse=True)[1], times[rows]
        frame = frame.iloc[rows]
        places, told = columns.positions(frame)
        velocities = columns.velocities(frame)
        plane, places = _in_plane(places, told, codes) if columns.geodetic and len(rows) else (None, places)
        told &= ~_repeated(codes, times, places, velocities)
        places = np.where(told[:, None], places, 0.0)
        return cls(rows, codes, Paths(gaps(times, codes, told, gap), times, places, velocities, told), plane)


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
        those of sensors that measure no positions; others without a position get one. Deviations are NaN where no object
        has three reports.

    Raises
    ------
    InputError
        If no column looks like a time or a position, if there is no column `by`, or if rows of one object are of several.
    """
    frame = frame_of(data)
    named = frame if all(name is None for name in frame.index.names) else frame.reset_index()
    named = named.set_axis([str(title) for title in named.columns], axis=1)
    columns = Columns.of(FrameTable(named), by, list(named.columns))
    longest = seconds("gap", gap)
    columns, model, reports, rounding = learned(named, columns, longest)
    check_apart(reports.paths, reports.objects, columns.name, rounding, "the data", "by=COLUMN")
    result, rows = smoothed_frame(named, columns, reports, model, seconds("every", every))
    if every is None:
        result = result.iloc[np.argsort(rows, kind="stable")]
        return result.set_axis(frame.index[np.sort(rows)]) if named.index is frame.index else result
    return result


def learned(frame: Any, columns: Columns, gap: float | None) -> tuple[Columns, Model, Reports, float]:
    """Return the columns, with a speed's unit that was not stated, the model of a frame's objects, its reports, and the
    deviation in m of what their digits leave out.

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
        columns = columns.in_speed_unit(steps, columns.numbers(columns.speed, frame)[reports.rows])
        reports = Reports.of(frame, columns, gap)
    rounding = columns.rounding(frame)
    return columns, sampled(reports.paths, reports.objects, rounding), reports, rounding


def seconds(name: str, value: float | str | None) -> float | None:
    """Return a time in s, above 0; InputError for another."""
    try:
        seconds = None if value is None else in_unit(value, "s")
    except ValueError as error:
        raise InputError(f"{name}: {error}") from None
    if seconds is not None and not 0 < seconds < np.inf:
        raise InputError(f"{name}: must be a time above 0, got {value!r}")
    return seconds


def smoothed_frame(frame: Any, columns: Columns, reports: Reports, model: Model, every: float | None) -> tuple[Any, Indices]:
    """Return the smoothed rows, by object and time, and the row of the frame that each comes from."""
    paths, objects = reports.paths, reports.objects
    if every is None:
        smooth = smoothed(paths, objects, model)
        rows, codes, times = reports.rows, reports.codes, None
    else:
        wider, asked, last = _resampled(paths, every)
        every_row = smoothed(wider, objects, model)
        smooth = Smooth(
            every_row.estimates.only(asked), np.zeros(len(asked), dtype=bool), every_row.piece[asked], every_row.objects
        )
        rows, codes, times = reports.rows[last], reports.codes[last], wider.times[asked]
    result = frame.iloc[rows].copy()
    first_piece = np.searchsorted(smooth.objects, codes)
    _write(result, columns, reports.plane, codes, smooth, smooth.piece - first_piece, told=model.told)
    if times is not None:
        result[columns.time.title] = _as_before(frame[columns.time.title], times, columns)
        result = result.reset_index(drop=True).drop(columns=GROSS)
    return result, rows


def _repeated(*columns: Array | Indices) -> Mask:
    """Return which rows say the same as the row before: sent or received twice, they tell nothing more."""
    same = np.zeros(len(columns[0]), dtype=bool)
    if len(same):
        same[1:] = np.all(
            [np.all((c[1:] == c[:-1]) | np.isnan(c[1:]), axis=tuple(range(1, c.ndim))) for c in columns], axis=0
        )
    return same


def _in_plane(places: Array, told: Mask, codes: Indices) -> tuple[Plane, Array]:
    """Return the plane of each object and the positions in it; a row without one is where the one before it is."""
    last = np.maximum.accumulate(np.where(told, np.arange(len(told)), 0))
    starts = np.concatenate([[0], np.flatnonzero(np.diff(codes)) + 1, [len(codes)]]).astype(int)
    first = starts[:-1][codes]
    later = np.minimum.accumulate(np.where(told, np.arange(len(told)), len(told))[::-1])[::-1]
    known = np.where((last >= first) & told[last], last, np.minimum(later, len(told) - 1))
    filled = np.where(told[known][:, None], places[known], 0.0)
    plane, steady = Plane.of(filled, starts)
    return plane, plane.to_plane(steady, codes)


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
    step = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    times = (low[piece] + step) * every
    n, whose = len(paths), np.repeat(np.arange(len(count)), paths.lengths)
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


def _write(
    frame: Any, columns: Columns, plane: Plane | None, codes: Indices, smooth: Smooth, piece: Indices, *, told: bool
) -> None:
    """Write estimates into a frame's columns, in its units; deviations only if they are told."""
    estimates = smooth.estimates
    spots, velocities = estimates.spots, estimates.velocities
    stretch: Array = np.ones((1, 2))
    if plane is not None:
        spots = plane.from_plane(spots, codes)
        stretch = plane.stretch(spots[:, 1], codes)
        velocities = velocities / stretch
    digits = 9 if plane is not None else 6
    pair = spots[:, ::-1] if columns.north_first else spots
    for column, values in zip(columns.place, pair.T, strict=True):
        frame[column.title] = np.round(values / column.factor, digits)
    speed = np.hypot(velocities[:, 0], velocities[:, 1])
    if columns.paces is not None:
        paces = velocities[:, ::-1] if columns.north_first and not columns.geodetic else velocities
        for column, values in zip(columns.paces, paces.T, strict=True):
            frame[column.title] = np.round(values / column.factor, 6)
    for found_column, usual, values in (
        (columns.speed, SPEED, speed),
        (columns.course, COURSE, np.degrees(np.arctan2(velocities[:, 0], velocities[:, 1])) % 360.0),
    ):
        title, factor = (found_column.title, found_column.factor) if found_column else (usual, 1.0)
        frame[title] = np.round(values / factor, 6)
    pace_deviation = np.sqrt(estimates.velocity_variances) / stretch.mean(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(speed > 0, np.degrees(np.arctan2(pace_deviation, speed)), 90.0)
    deviations = np.sqrt(estimates.spot_variances) / stretch.mean(axis=-1), pace_deviation, turned
    for title, values in zip(DEVIATIONS, deviations, strict=True):
        frame[title] = np.round(values, 6) if told else np.nan
    frame[PIECE], frame[GROSS] = piece, smooth.gross


def _as_before(cells: Any, times: Array, columns: Columns) -> Any:
    """Return times in s as a column writes them: numbers in its unit, dates, or dates as text."""
    pd = needed("pandas", "tables need pandas", "data")
    if not dated(cells):
        return times / columns.time.factor
    when = pd.to_datetime(np.rint(times * 1e6).astype("int64"), unit="us", utc=True)
    if columns.dates:
        return when.strftime(columns.dates)
    if pd.api.types.is_datetime64_any_dtype(cells):
        return when if cells.dt.tz is not None else when.tz_localize(None)
    first = next((str(cell) for cell in cells if str(cell).strip()), "")
    text = when.strftime("%Y-%m-%dT%H:%M:%S.%f" if "T" in first else "%Y-%m-%d %H:%M:%S.%f").str.rstrip("0").str.rstrip(".")
    zoned = first.endswith(("Z", "z")) or "+" in first
    return text + "Z" if zoned else text
