"""Trajectory GOSPA: errors, misses, false tracks and identity switches of whole trajectories in one metric."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, kernels
from vedette.metrics import Near
from vedette_standard.whole_tracks.near_in_scans import near_in_scans


@frozen
class TrajectoryGospa:
    """`value` in m, and its parts in m^order: value^order = localisation + missed + false + switches."""

    value: float
    localisation: float
    missed: float
    false: float
    switches: float


@frozen(eq=False)
class _Part:
    """Objects and tracks that are near one another directly or in a chain, at the scans at which any of them are.

    truth (q,) and track (q,): the pairs, numbered from 0 within the part; gain (k, q): (d / c)^p - 1 where a pair is nearer
    than c, else 0.
    """

    truth: Indices
    track: Indices
    gain: Array


def trajectory_gospa(
    apart: Sequence[Array | Near],
    present: Sequence[Indices],
    alive: Mask,
    cutoff: float,
    switch: float,
    order: float = 2.0,
    limit: float = np.inf,
) -> TrajectoryGospa | None:
    """Return the trajectory metric in its form as a linear program, the least over assignments W^1 ... W^s of

    ( sum_k sum over pairs W_ij^k d_ij^p + c^p / 2 (missed + false) + g^p / 2 sum_k sum_ij |W_ij^k - W_ij^(k+1)| )^(1/p),

    with 0 <= W and sums over each object and each track <= 1. `apart`: per scan the distances (j, t) in m, infinite for an
    object that is not there; `present`: which tracks the columns are; `alive` (s, j); `switch`: g in m, what a track that
    passes from one object to another costs. Not divided by the number of scans. None if a linear program would have more
    than `limit` variables: objects and tracks need one where they compete, and its cost grows faster than its size.
    Garcia-Fernandez, Rahmathullah, Svensson, A Metric on the Space of Finite Sets of Trajectories, IEEE T-SP 68, 2020.
    """
    if not (cutoff > 0 and switch >= 0 and order >= 1):
        raise ValueError(f"cutoff: must be > 0 m, switch >= 0, order >= 1, got {cutoff:g}, {switch:g} and {order:g}")
    penalty = 0.5 * (switch / cutoff) ** order
    missed, false = 0.5 * np.count_nonzero(alive), 0.5 * sum(len(columns) for columns in present)
    near = changes = 0.0
    for part in _parts(apart, present, cutoff, order):
        weight = _assigned(part, penalty, limit)
        if weight is None:
            return None
        paired = 0.5 * float(np.sum(weight[part.gain < 0]))
        missed, false = missed - paired, false - paired
        near += 2 * paired + float(np.sum(weight * part.gain))
        changes += penalty * float(np.sum(np.abs(np.diff(weight, axis=0))))
    power = cutoff**order
    value = cutoff * max(near + missed + false + changes, 0.0) ** (1 / order)
    return TrajectoryGospa(value, power * near, power * missed, power * false, power * changes)


def _parts(apart: Sequence[Array | Near], present: Sequence[Indices], cutoff: float, order: float) -> Iterator[_Part]:
    """Yield the parts of the problem that can be solved on their own.

    A pair that is never nearer than c costs at every scan what leaving both out costs. A scan at which no pair of a part is
    near changes nothing in it: W may stay as it is there. So only near pairs, and their scans, count.
    """
    scan, truth, track, distance = near_in_scans(apart, present, cutoff)
    if not len(scan):
        return
    gain = (distance / cutoff) ** order - 1.0
    wide = int(np.max(track)) + 1
    keys, pair = np.unique(truth * wide + track, return_inverse=True)
    pairs, pair = np.stack(np.divmod(keys, wide)), pair.reshape(-1)
    part = kernels.linked_clusters(pairs[0], pairs[1], int(np.max(truth)) + 1, wide)[pairs[0]]
    order_of = np.argsort(part[pair], kind="stable")
    for entries in np.split(order_of, np.flatnonzero(np.diff(part[pair][order_of])) + 1):
        near_pairs, column = np.unique(pair[entries], return_inverse=True)
        scans, row = np.unique(scan[entries], return_inverse=True)
        table = np.zeros((len(scans), len(near_pairs)))
        table[row.reshape(-1), column.reshape(-1)] = gain[entries]
        rows, columns = (np.unique(pairs[side, near_pairs], return_inverse=True)[1].reshape(-1) for side in (0, 1))
        yield _Part(rows, columns, table)


def _assigned(part: _Part, penalty: float, limit: float) -> Array | None:
    """Return the weights (k, q) of the pairs at the least cost, in units of c^p; None beyond the limit."""
    for side, other in ((part.truth, part.track), (part.track, part.truth)):
        # without the sums over one side the other side's members are solved apart: a bound, and the solution where it fits
        weight = np.zeros(part.gain.shape)
        for member in range(int(np.max(side)) + 1):
            weight[:, side == member] = _star(part.gain[:, side == member], penalty)
        if all(np.sum(weight[:, other == member], axis=1).max() <= 1.0 for member in range(int(np.max(other)) + 1)):
            return weight
    scans, pairs = part.gain.shape
    return _program(part, penalty) if (2 * scans - 1) * pairs <= limit else None


def _star(gain: Array, penalty: float) -> Array:
    """Solve a part of one object, or of one track: the best path through its pairs (k, q), by dynamic programming.

    Its linear program has a solution of whole numbers: |W^k - W^(k+1)| is a distance in a tree, with no pair in the middle.
    No gain is above 0, so staying with a pair is never worse than having none.
    """
    scans, pairs = gain.shape
    best = gain[0]
    stays, from_pair = np.ones((scans, pairs), dtype=bool), np.zeros(scans, dtype=np.intp)
    for k in range(1, scans):
        from_pair[k] = np.argmin(best)
        switched = best[from_pair[k]] + 2 * penalty
        stays[k] = best <= switched
        best = gain[k] + np.minimum(best, switched)
    weight, at = np.zeros(gain.shape), int(np.argmin(best))
    for k in range(scans - 1, -1, -1):
        weight[k, at] = 1.0
        at = at if stays[k, at] else int(from_pair[k])
    return weight


def _program(part: _Part, penalty: float) -> Array:
    """Solve a part's linear program over W (k, q) and the changes from scan to scan (k-1, q)."""
    from scipy.optimize import linprog
    from scipy.sparse import coo_matrix

    scans, pairs = part.gain.shape
    weight = np.arange(scans * pairs).reshape(scans, pairs)
    change = weight.size + np.arange((scans - 1) * pairs)
    shared = [side == number for side in (part.truth, part.track) for number in np.flatnonzero(np.bincount(side) > 1)]
    capacity = [weight[:, members] for members in shared]
    before, after = weight[:-1].ravel(), weight[1:].ravel()
    many = scans * len(shared)
    up, down = many + np.arange(len(change)), many + len(change) + np.arange(len(change))
    entries: list[tuple[Indices, Indices, float]] = [
        (np.repeat(i * scans + np.arange(scans), held.shape[1]), held.ravel(), 1.0) for i, held in enumerate(capacity)
    ]
    for rows, plus, minus in ((up, after, before), (down, before, after)):
        entries += [(rows, plus, 1.0), (rows, minus, -1.0), (rows, change, -1.0)]
    row, column = (np.concatenate([entry[i] for entry in entries]) for i in (0, 1))
    value = np.concatenate([np.full(len(entry[0]), entry[2]) for entry in entries])
    limits = coo_matrix((value, (row, column)), shape=(many + 2 * len(change), weight.size + len(change))).tocsr()
    most = np.concatenate([np.ones(many), np.zeros(2 * len(change))])
    cost = np.concatenate([part.gain.ravel(), np.full(len(change), penalty)])
    solution = linprog(cost, A_ub=cast(Any, limits), b_ub=most, bounds=(0, None), method="highs")
    if solution.x is None:
        raise ArithmeticError(f"trajectory GOSPA: the linear program of {len(cost)} variables failed: {solution.message}")
    return np.asarray(solution.x[: weight.size]).reshape(scans, pairs)
