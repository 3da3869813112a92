"""What smoothing writes: estimates in the columns and units of the table that they are of."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.space import Array, Indices, Mask
from vedette_files.libraries import needed
from vedette_tools.smoothing.columns import Columns, dated
from vedette_tools.smoothing.linear import Estimates
from vedette_tools.smoothing.plane import Plane

DEVIATIONS = ("position_deviation_m", "speed_deviation_mps", "course_deviation_deg")
"""The columns of deviations: of a position and of a speed along an axis, and of a course."""

PIECE, GROSS = "piece", "gross"
"""The columns that number an object's unbroken stretches, and mark positions that were taken to be wrong."""

SPEED, COURSE = "speed_mps", "course_deg"
"""The columns of speeds and courses in tables that have none."""


def written(columns: Columns, plane: Plane | None, codes: Indices, estimates: Estimates, claimed: Mask) -> dict[str, Any]:
    """Return estimates by the titles of columns, in their units; deviations only of the rows (n,) where they are claimed."""
    cells: dict[str, Any] = {}
    spots, velocities = estimates.spots, estimates.velocities
    stretch: Array = np.ones((1, 2))
    if plane is not None:
        spots = plane.from_plane(spots, codes)
        stretch = plane.stretch(spots[:, 1], codes)
        velocities = plane.turned(velocities / stretch, spots[:, 0], codes, back=True)
    digits = 9 if plane is not None else 6
    pair = spots[:, ::-1] if columns.north_first else spots
    for column, values in zip(columns.place, pair.T, strict=True):
        cells[column.title] = np.round(values / column.factor, digits)
    speed = np.hypot(velocities[:, 0], velocities[:, 1])
    if columns.paces is not None:
        paces = velocities[:, ::-1] if columns.north_first and not columns.geodetic else velocities
        for column, values in zip(columns.paces, paces.T, strict=True):
            cells[column.title] = np.round(values / column.factor, 6)
    for found_column, usual, values in (
        (columns.speed, SPEED, speed),
        (columns.course, COURSE, np.degrees(np.arctan2(velocities[:, 0], velocities[:, 1])) % 360.0),
    ):
        title, factor = (found_column.title, found_column.factor) if found_column else (usual, 1.0)
        cells[title] = np.round(values / factor, 6)
    pace_deviation = np.sqrt(estimates.velocity_variances) / stretch.mean(axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.where(speed > 0, np.degrees(np.arctan2(pace_deviation, speed)), 90.0)
    deviations = np.sqrt(estimates.spot_variances) / stretch.mean(axis=-1), pace_deviation, turned
    for title, values in zip(DEVIATIONS, deviations, strict=True):
        cells[title] = np.where(claimed, np.round(values, 6), np.nan)
    return cells


def as_before(cells: Any, times: Array, columns: Columns) -> Any:
    """Return times in s as a column writes them: numbers in its unit, dates, or dates as text."""
    pd = needed("pandas", "tables need pandas", "data")
    if not dated(cells) and cells.dtype.kind != "m":
        return times / columns.time.factor
    when = pd.DatetimeIndex(np.rint(times * 1e6).astype("datetime64[us]"), tz="UTC")
    if cells.dtype.kind == "m":
        return pd.to_timedelta(times, unit="s")
    if columns.dates:
        return when.strftime(columns.dates)
    if pd.api.types.is_datetime64_any_dtype(cells):
        return when.tz_convert(cells.dt.tz)
    first = next((str(cell) for cell in cells if str(cell).strip()), "")
    text = when.strftime("%Y-%m-%dT%H:%M:%S.%f" if "T" in first else "%Y-%m-%d %H:%M:%S.%f").str.rstrip("0").str.rstrip(".")
    zoned = first.endswith(("Z", "z")) or "+" in first
    return text + "Z" if zoned else text
