"""Which points lie in which boxes, and which tracks and returns hang together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vedette.kernels.results import BoxPairs
from vedette.space import Array, Indices, Mask, Periods

_AT_ONCE = 1_000_000


def by_width(number: Indices) -> Iterator[tuple[Indices, Indices, Mask]]:
    """Yield rows (g,) of a table in groups that have about as many of its entries, whose numbers (t,) are given row by row.

    With each group come the places (g, w) of its entries, and which of these there are: others are the row's first place.
    """
    starts = np.cumsum(number) - number
    width = 2 ** np.ceil(np.log2(np.maximum(number, 1))).astype(np.int64)
    for w in np.unique(width).tolist():
        rows = np.flatnonzero(width == w)
        there = np.arange(w) < number[rows, None]
        yield rows, starts[rows, None] + np.where(there, np.arange(w), 0), there


def pairs_in_boxes(low: Array, high: Array, points: Array, periods: Periods, most: int) -> BoxPairs:
    """Return the pairs (p,), (p,) of a box and a point in it, by boxes, then points; the first `most` + 1 if there are more.

    low and high (t, m), edges included, points (k, m). `periods`: index and period of axes that wrap, where a box goes up
    from `low` by high - low. A point with a component that is not finite is in no box.
    """
    k, m = points.shape
    first, second, count = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)], 0
    wraps = dict(periods)
    finite = np.isfinite(points).all(axis=-1)
    step = max(1, _AT_ONCE // max(k, 1))
    for start in range(0, len(low), step):
        part = slice(start, start + step)
        inside = np.broadcast_to(finite, (len(low[part]), k)).copy()
        for axis in range(m):
            lowest, highest, place = low[part, axis, None], high[part, axis, None], points[:, axis]
            if axis in wraps:
                with np.errstate(invalid="ignore"):
                    above = (place - lowest) / wraps[axis]
                    inside &= (above - np.floor(above)) * wraps[axis] <= highest - lowest
            else:
                inside &= (place >= lowest) & (place <= highest)
        boxes, held = np.nonzero(inside)
        first.append(boxes + start)
        second.append(held)
        count += len(boxes)
        if count > most:
            break
    return BoxPairs(np.concatenate(first)[: most + 1], np.concatenate(second)[: most + 1])


def linked_clusters(tracks: Indices, returns: Indices, t: int, k: int) -> Indices:
    """Return the number (t+k,) of the cluster that each track, and each return, is in, in the order of their first members.

    tracks and returns (p,): the pairs that link them. What is in no pair is a cluster of its own.
    """
    labels, before = np.arange(t + k), np.zeros(0, dtype=np.int64)
    while not np.array_equal(labels, before):
        before = labels.copy()
        least = np.minimum(labels[tracks], labels[t + returns])
        np.minimum.at(labels, tracks, least)
        np.minimum.at(labels, t + returns, least)
        labels = labels[labels]
    return np.unique(labels, return_inverse=True)[1].reshape(t + k)
