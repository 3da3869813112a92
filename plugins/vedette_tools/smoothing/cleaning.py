"""Reports put in order: pieces without gaps, and positions that cannot be right."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Indices, Mask
from vedette_tools.smoothing.paths import Paths

USUAL, LONG = 20.0, 5.0
"""A gap is longer than so many usual times between an object's reports, and so many times longer than one in twenty is."""

FAR, PASSES = 10.0, 2
"""A position is gross that lies so many times farther from the line between its neighbours than these do without it, and
than is usual: by hand. Those beside one show once it is out."""

BENT, MOST, CALM, WIDE = 4.0, 0.9, 3.0, 2.0
"""Or that lies so many times farther from the cubic through two before and two after than such a part of all do, while these
lie less than so many times as far from their line without it as is usual, and no more than so many usual waits apart: where
an object turns about, all are far from lines. By hand: drawn outliers of an animal reach 4.4 times, its other positions 1.9;
of 22,760 recorded positions of ships and aircraft 8 more are gross by it.
"""


def gaps(times: Array, whose: Indices, told: Mask, limit: float | None = None) -> Indices:
    """Return where pieces start among rows in the order of objects and times, and the number of rows.

    told: rows that report a position; where none does between two gaps, these are bridged, as a position is asked for.
    limit: the longest time in s within a piece; by default each object's own reports say what is long.
    """
    dt = np.diff(times)
    same = np.diff(whose) == 0
    most = np.full(len(times), np.inf if limit is None else limit)
    if limit is None:
        starts = np.flatnonzero(np.concatenate([[True], ~same, [True]]))
        for first, last in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True):
            waits = dt[first : last - 1]
            if len(waits) > 2:
                waits = np.sort(waits[waits > 0])
                usual = waits[len(waits) // 2] if len(waits) else np.inf
                rare = waits[int(0.95 * (len(waits) - 1))] if len(waits) else np.inf
                most[first:last] = max(USUAL * usual, LONG * rare)
    begins = ~same | (dt > most[1:])
    starts = np.concatenate([[0], np.flatnonzero(begins) + 1, [len(times)]]).astype(int)
    asks = np.flatnonzero(np.diff(np.concatenate([[0], np.cumsum(told)])[starts]) == 0)
    bridged = np.unique(np.concatenate([starts[asks], starts[asks + 1]]))
    bridged = bridged[(bridged > 0) & (bridged < len(times))]
    return np.setdiff1d(starts, bridged[same[bridged - 1]])


def gross(paths: Paths) -> Mask:
    """Return which positions lie far off the line between those before and after, where these do not."""
    wrong = np.zeros(len(paths), dtype=bool)
    for _ in range(PASSES):
        kept = np.flatnonzero(~wrong)
        more = _spikes(paths.only(kept, np.searchsorted(kept, paths.starts)))
        if not more.any():
            break
        wrong[kept] |= more
    return wrong


def _spikes(paths: Paths) -> Mask:
    """Return which positions stand out alone."""
    n, outlying = len(paths), np.zeros(len(paths), dtype=bool)
    piece = paths.piece
    rows = np.arange(2, n - 2)
    rows = rows[(piece[rows - 2] == piece[rows + 2])]
    if not len(rows):
        return outlying
    off = off_line(paths, rows - 1, rows, rows + 1)
    beside = np.maximum(off_line(paths, rows - 2, rows - 1, rows + 1), off_line(paths, rows - 1, rows + 1, rows + 2))
    of = piece[rows]
    outlying[rows] = (off > FAR * beside) & (off > FAR * _usual(off, of)) & (off > 0)
    bent, span = off_cubic(paths, rows), paths.times[rows + 2] - paths.times[rows - 2]
    calm = (beside < CALM * _usual(beside, of)) & (span <= WIDE * _usual(span, of))
    outlying[rows] |= (bent > BENT * _usual(bent, of, MOST)) & calm
    return outlying


def _usual(values: Array, piece: Indices, part: float = 0.5) -> Array:
    """Return what such a part of the values of each one's piece do not exceed, by default the median."""
    order = np.lexsort((values, piece))
    of = piece[order]
    first, last = (np.searchsorted(of, piece, side=side) for side in ("left", "right"))
    return np.asarray(values[order][first + np.floor(part * (last - first)).astype(int)])


def off_cubic(paths: Paths, at: Indices) -> Array:
    """Return how far positions lie from the cubic through two before and after, at their time; 0 if times repeat.

    In m that errors of all five amount to: where waits are unlike, the cubic magnifies those of the four.
    """
    beside = at[:, None] + np.array([-2, -1, 1, 2])
    t, weights = paths.times[beside] - paths.times[at][:, None], np.empty((len(at), 4))
    for i in range(4):
        others = np.delete(np.arange(4), i)
        apart = np.prod(t[:, i, None] - t[:, others], axis=-1)
        weights[:, i] = np.where(apart != 0, np.prod(-t[:, others], axis=-1) / np.where(apart != 0, apart, 1.0), np.nan)
    off = np.linalg.norm(np.sum(weights[..., None] * (paths.spots[at][:, None] - paths.spots[beside]), axis=1), axis=-1)
    return np.asarray(np.nan_to_num(off / np.sqrt(1.0 + np.sum(weights**2, axis=-1))))


def off_line(paths: Paths, before: Indices, at: Indices, after: Indices) -> Array:
    """Return how far positions lie from the line between two others, at their time, in m."""
    t, z = paths.times, paths.spots
    span = t[after] - t[before]
    part = np.where(span > 0, (t[at] - t[before]) / np.where(span > 0, span, 1.0), 0.5)[..., None]
    return np.asarray(np.linalg.norm(z[at] - z[before] - part * (z[after] - z[before]), axis=-1))
