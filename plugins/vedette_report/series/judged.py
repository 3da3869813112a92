"""What the judge says of a block of scans, as columns of the series: pairs with the truth, errors, NEES and NIS."""

from __future__ import annotations

from functools import cache

import numpy as np

from vedette.metrics import NONE, Block, chi_square_band, positions, velocities
from vedette.space import Array, Indices, Mask
from vedette_files import Column, Tables
from vedette_report.series.traces import BAND, sigma_of, with_innovation

ENTRIES = ("position_error", "position_sigma", "velocity_error", "velocity_sigma", "nees", "nis_given_hit")


def judged(block: Block | None, scans: int, confirmed: Mask) -> Tables:
    """Return the judged columns of a block's scans (s,) and of its entries (e,), of which some are `confirmed`.

    NaN, NONE or 0 where the judge says nothing: of tentative tracks, of scans that it leaves out.
    """
    entries: dict[str, Column] = {"object": np.full(len(confirmed), NONE, dtype=np.int32)}
    entries |= {name: np.full(len(confirmed), np.nan) for name in ENTRIES}
    if block is None:
        none = np.zeros(0, dtype=np.intp)
        truth_of = np.zeros(len(confirmed), dtype=np.intp)
        columns = _of_scans(entries, scans, truth_of, none, 0, np.zeros(scans, dtype=np.intp))
        return {"scans": {"judged": np.zeros(scans, dtype=bool), **columns}, "entries": entries}
    match, place = block.found, np.flatnonzero(confirmed)
    pairs, space = block.pairs, match.truth.space
    rows, spot, speed = place[pairs.entry], positions(space), velocities(space)
    cov = match.entries.cov[pairs.entry]
    entries["object"][rows] = block.which[pairs.truth]
    entries["position_error"][rows] = np.linalg.norm(pairs.error[:, spot], axis=-1)
    entries["position_sigma"][rows] = sigma_of(cov, spot)
    if speed:
        entries["velocity_error"][rows] = np.linalg.norm(pairs.error[:, speed], axis=-1)
        entries["velocity_sigma"][rows] = sigma_of(cov, speed)
    entries["nees"][rows] = pairs.nees
    seen = with_innovation(match.entries, block.chosen)
    entries["nis_given_hit"][place[seen]] = match.entries.nis[seen] / match.entries.hit[seen]
    scan = np.zeros(len(confirmed), dtype=int)
    scan[place] = match.entries.scan
    columns = _of_scans(entries, scans, scan, rows, len(spot), block.axes)
    return {"scans": {"judged": np.isin(np.arange(scans), match.scans), **columns}, "entries": entries}


def _of_scans(
    entries: dict[str, Column], scans: int, scan: Indices, covered: Indices, spot: int, axes: Indices
) -> dict[str, Column]:
    """Return the columns of scans: how many objects are covered, the error, and means of NEES and NIS with their bands.

    `scan` (e,) is that of each entry, `covered` the entries of covered objects; `spot` axes has a position, and `axes` (s,)
    a return of each scan.
    """
    squares: Array = np.bincount(scan[covered], entries["position_error"][covered] ** 2, scans).astype(float)
    count = np.bincount(scan[covered], minlength=scans)
    return {
        "covered": count.astype(np.int32),
        "position_rmse": np.sqrt(_over(squares, count)),
        **_consistency("nees", scan, entries["nees"], np.full(scans, spot)),
        **_consistency("nis", scan, entries["nis_given_hit"], axes),
    }


def _consistency(name: str, scan: Indices, values: Array, axes: Indices) -> dict[str, Column]:
    """Return of each scan the mean over its n finite values, n, and the band of that mean: chi-square of n d, over n."""
    known = np.isfinite(values)
    count = np.bincount(scan[known], minlength=len(axes))
    bands = [_band(n, d) if n else (np.nan, np.nan) for n, d in zip(count.tolist(), axes.tolist(), strict=True)]
    low, high = np.array(bands, dtype=float).reshape(-1, 2).T
    return {
        name: _over(np.bincount(scan[known], values[known], len(axes)).astype(float), count),
        f"{name}_count": count.astype(np.int32),
        f"{name}_low": low,
        f"{name}_high": high,
    }


@cache
def _band(count: int, axes: int) -> tuple[float, float]:
    """Return the band of a mean over `count` independent values of `axes` degrees of freedom each."""
    low, high = chi_square_band(count * axes, BAND)
    return axes * low, axes * high


def _over(total: Array, count: Indices) -> Array:
    """Return total / count, NaN where there are none."""
    return np.divide(total, count, out=np.full(len(count), np.nan), where=count > 0)
