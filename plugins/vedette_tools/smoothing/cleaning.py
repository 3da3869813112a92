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
    usual = np.zeros(len(paths.lengths))
    order = np.lexsort((off, piece[rows]))
    of = piece[rows][order]
    first = np.searchsorted(of, np.arange(len(usual)))
    count = np.searchsorted(of, np.arange(len(usual)), side="right") - first
    some = count > 0
    usual[some] = off[order][first[some] + count[some] // 2]
    outlying[rows] = (off > FAR * beside) & (off > FAR * usual[piece[rows]]) & (off > 0)
    return outlying


def off_line(paths: Paths, before: Indices, at: Indices, after: Indices) -> Array:
    """Return how far positions lie from the line between two others, at their time, in m."""
    t, z = paths.times, paths.spots
    span = t[after] - t[before]
    part = np.where(span > 0, (t[at] - t[before]) / np.where(span > 0, span, 1.0), 0.5)[..., None]
    return np.asarray(np.linalg.norm(z[at] - z[before] - part * (z[after] - z[before]), axis=-1))
