"""Marginals of all joint associations in which no two tracks share a return, summed exactly.

Tracks that share returns, directly or through others, are a cluster. In each, one side, tracks or returns, is gone through
row by row. What counts of the rows before is which columns of the other side they took, of those that later rows can still
take: the open ones. So the sums are over the sets of open columns, 2^open at most, and the order of the rows keeps few open.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette.kernels.boxes import linked_clusters
from vedette.kernels.reference import exp_or_zero, log_sum, normal_or_zero
from vedette.kernels.results import JointWeights
from vedette.space import Array, Mask

Numbers = NDArray[np.intp]

MOST_OPEN = 16
"""Most columns that may be open at once."""
MOST_SETS = 2**22
"""Most sets of open columns, over all rows of a cluster."""
LEAST_MISS = -3000.0
"""A miss gets at least this log weight beside a track's best return, in case nothing else is left for the track."""


def joint_weights(scores: Array, most: int) -> JointWeights:
    """Return the weights (*b, t, 1+k) by log scores of that shape, column 0 the miss, and `wide_clusters`.

    A track of a cluster that is too wide gets the weights that it would have if it were alone.
    Fortmann, Bar-Shalom, Scheffe, Sonar Tracking of Multiple Targets Using JPDA, IEEE J. Oceanic Engineering 8, 1983.
    Horridge, Maskell, Real-Time Tracking of Hundreds of Targets with Efficient Exact JPDAF Implementation, FUSION 2006.
    """
    scores = np.asarray(scores, dtype=float)
    gain = _gains(scores)
    weights = exp_or_zero(gain - log_sum(gain)[..., None])
    wide = np.zeros(scores.shape[:-1], dtype=bool)
    for run in np.ndindex(scores.shape[:-2]):
        for cluster in _clusters(np.isfinite(scores[run][:, 1:])):
            part = gain[run][np.ix_(cluster.tracks, np.concatenate([[0], 1 + cluster.returns]))]
            plan = _plan(cluster.shared, most)
            if plan is None:
                wide[run][cluster.tracks] = True
                continue
            alone = np.where(np.isfinite(gain[run][cluster.tracks]), gain[run][cluster.tracks], -np.inf)
            alone[:, 1 + cluster.returns] = -np.inf
            stay = log_sum(alone)
            free, claims = _marginals(part[:, 1:] - stay[:, None], *plan)
            weights[run][cluster.tracks] = free[:, None] * exp_or_zero(alone - stay[:, None])
            weights[run][np.ix_(cluster.tracks, 1 + cluster.returns)] = claims
    return JointWeights(normal_or_zero(weights), wide)


def wide_clusters(scores: Array, most: int) -> Mask:
    """Return the tracks (*b, t) of clusters in which more than `most` tracks, and returns, would be open at once.

    So are those for which it would take more than MOST_SETS sets.
    """
    wide = np.zeros(np.shape(scores)[:-1], dtype=bool)
    for run in np.ndindex(wide.shape[:-1]):
        for cluster in _clusters(np.isfinite(scores[run][:, 1:])):
            wide[run][cluster.tracks] = _plan(cluster.shared, most) is None
    return wide


@frozen(eq=False)
class Cluster:
    """At least two tracks, the returns that two of them or more can take, and which track can take which (t, k)."""

    tracks: Numbers
    returns: Numbers
    shared: Mask


def _gains(scores: Array) -> Array:
    """Return the scores over that of the miss; one that cannot be is given a finite score."""
    miss = np.maximum(scores[..., :1], np.max(scores, axis=-1, keepdims=True) + LEAST_MISS)
    return np.concatenate([np.zeros_like(miss), scores[..., 1:] - miss], axis=-1)


def _clusters(linked: Mask) -> Iterator[Cluster]:
    """Yield the clusters of at least two tracks; linked (t, k)."""
    shared = linked & (linked.sum(axis=0) > 1)
    track, taken = np.nonzero(shared)
    labels = linked_clusters(track, taken, *shared.shape)
    for label in np.unique(labels[track]).tolist():
        tracks, returns = (np.flatnonzero(side == label) for side in np.split(labels, [len(shared)]))
        yield Cluster(tracks, returns, shared[np.ix_(tracks, returns)])


def _plan(linked: Mask, most: int) -> tuple[list[int], bool] | None:
    """Return the order of rows, and whether they are the tracks or else the returns; None if too many would be open."""
    most = min(most, MOST_OPEN)
    (by_tracks, one), (by_returns, other) = _order(linked, most), _order(linked.T, most)
    if min(one, other) > MOST_SETS:
        return None
    return (by_tracks, True) if one <= other else (by_returns, False)


def _order(linked: Mask, most: int) -> tuple[list[int], float]:
    """Return the order of rows, and the number of sets of open columns, summed over the rows, or infinity.

    Next is always the row after which fewest columns are open, then the one during which fewest are, then the first.
    """
    pairs, degrees = linked.astype(np.intp), linked.sum(axis=0)
    left, waiting, order, sets, before = degrees.copy(), list(range(len(linked))), [], 0.0, 0
    while waiting:
        during = before + pairs[waiting] @ (left == degrees)
        after = during - pairs[waiting] @ (left == 1)
        allowed = np.flatnonzero(during <= most)
        if not len(allowed):
            return [], np.inf
        best = allowed[np.lexsort((during[allowed], after[allowed]))[0]]
        sets, before = sets + 2.0 ** float(during[best]), int(after[best])
        order.append(waiting.pop(int(best)))
        left = left - pairs[order[-1]]
    return order, sets


def _marginals(gain: Array, order: list[int], by_tracks: bool) -> tuple[Array, Array]:
    """Return each track's probability (t,) to take no return, and to take each (t, k), by log odds `gain` (t, k)."""
    linked, (free, other, weight) = np.isfinite(gain), _scaled(gain)
    if by_tracks:
        single, _, pairs = _summed(linked, weight, free, other, order)
    else:
        _, single, pairs = _summed(linked.T, weight.T, other, free, order)
        pairs = pairs.T
    total = single + np.sum(pairs, axis=1)
    return single / total, pairs / total[:, None]


def _scaled(gain: Array) -> tuple[Array, Array, Array]:
    """Return weights of at most 1 for tracks (t,) and returns (k,) that stay free, and for pairs (t, k).

    The dual numbers of the best association make its parts 1: no association of which the sum knows is lost.
    """
    from scipy.optimize import linear_sum_assignment

    t, k = gain.shape
    top = np.maximum(np.max(gain, axis=1, initial=0.0), 0.0)
    if np.sum(top) <= 500.0:
        return np.exp(-top), np.ones(k), exp_or_zero(gain - top[:, None])
    cost = np.full((t, k + t), np.inf)
    cost[:, :k], cost[range(t), range(k, k + t)] = -gain, 0.0
    columns = linear_sum_assignment(cost)[1]
    u, v, before = cost[range(t), columns], np.zeros(k + t), np.ones(k + t)
    while not np.array_equal(v, before):  # Bellman, Ford
        before, v = v, np.minimum(v, np.min(cost - u[:, None], axis=0))
        u = cost[range(t), columns] - v[columns]
    pairs = exp_or_zero(np.minimum(0.0, gain + u[:, None] + v[:k]) + v[k:, None])
    return exp_or_zero(np.minimum(0.0, u + v[k:])), exp_or_zero(v[:k]), pairs


def _summed(
    linked: Mask, weight: Array, free_row: Array, free_column: Array, order: list[int]
) -> tuple[Array, Array, Array]:
    """Return the probability of each row and column to stay free, and of each pair, over all matchings of linked pairs.

    A matching weighs as its pairs (p, q), free rows (p,) and free columns (q,) do together. Sums by sets of open columns
    have an axis of 2 for each of them.
    """
    rows, columns, pairs = np.zeros_like(free_row), np.zeros_like(free_column), np.zeros_like(weight)
    stages: list[tuple[Array, list[int], list[int], int, int]] = []
    sums: Array = np.ones(())
    places, left = list[int](), linked.sum(axis=0)
    for row in order:
        choices = np.flatnonzero(linked[row]).tolist()
        opened = places + [column for column in choices if column not in places]
        stages.append((sums, places, opened, row, -1))
        before: Array = np.zeros((2,) * len(opened))
        before[_none_of(len(opened) - len(places))] = sums
        sums, places = free_row[row] * before, opened
        for column in choices:
            _of(sums, places, column, 1)[...] += weight[row, column] * _of(before, places, column, 0)
        left[choices] -= 1
        for column in (column for column in choices if left[column] == 0):
            stages.append((sums, places, places, -1, column))
            sums = free_column[column] * _of(sums, places, column, 0) + _of(sums, places, column, 1)
            places = [other for other in places if other != column]
    after: Array = np.asarray(1.0 / sums)
    for before, places, opened, row, column in reversed(stages):
        if row < 0:
            columns[column] = free_column[column] * np.sum(_of(before, places, column, 0) * after)
            after = np.stack([free_column[column] * after, after], axis=places.index(column))
            continue
        later, after = after, free_row[row] * after
        for column in np.flatnonzero(linked[row]).tolist():
            _of(after, opened, column, 0)[...] += weight[row, column] * _of(later, opened, column, 1)
        none = _none_of(len(opened) - len(places))
        rows[row] = free_row[row] * np.sum(before * later[none])
        for column in np.flatnonzero(linked[row]).tolist():
            taken = np.zeros_like(later)
            _of(taken, opened, column, 0)[...] = _of(later, opened, column, 1)
            pairs[row, column] = weight[row, column] * np.sum(before * taken[none])
        after = after[none]
    return rows, columns, pairs


def _none_of(new: int) -> Any:
    """Return the index of the sums in which none of the `new` last columns is taken."""
    return (..., *(0,) * new)


def _of(sums: Array, places: list[int], column: int, taken: int) -> Array:
    """Return the sums for which an open column is taken (1) or not (0), a view."""
    return sums[(slice(None),) * places.index(column) + (taken, ...)]
