"""The k best assignments of rows to columns, and with them of the tracks of hypotheses to a scan's returns."""

from __future__ import annotations

import heapq
from itertools import count

import numpy as np

from vedette.kernels.results import Assignments, JointBest
from vedette.space import Array, Indices

FARTHEST = 3000.0
"""An impossible miss scores this much below the best of its row: so something is left where nothing else is possible."""


def k_best(cost: Array, k: int) -> Assignments:
    """Return the up to `k` cheapest assignments (k', n) and their costs (k',), ascending, those of equal cost by columns.

    cost (n, m): row i takes one column, a column is taken at most once; infinity forbids. None: k' = 0, as where n > m.
    Murty, An Algorithm for Ranking All the Assignments in Order of Increasing Cost, Operations Research 16, 1968; the
    compiled twin with the improvements of Miller, Stone, Cox, IEEE Trans. Aerospace and Electronic Systems 33, 1997.
    """
    cost = np.asarray(cost, dtype=float)
    n = cost.shape[0]
    cheapest: list[Indices] = []
    waiting: list[tuple[float, int, int, Array, Indices]] = []
    order = count()

    def divide(first: int, costs: Array) -> None:
        columns = _cheapest(costs)
        if columns is not None:
            heapq.heappush(waiting, (_sums(cost, columns[None])[0], next(order), first, costs, columns))

    if k > 0:
        divide(0, cost)
    while waiting and len(cheapest) < k:
        _, _, first, costs, columns = heapq.heappop(waiting)
        cheapest.append(columns)
        for row in range(first, n):  # all others: those that differ first in this row
            rest = costs.copy()
            rest[row, columns[row]] = np.inf
            divide(row, rest)
            taken = costs[row, columns[row]]
            costs = costs.copy()
            costs[row] = np.inf
            costs[row, columns[row]] = taken
    ranked = np.array(cheapest, dtype=np.int64).reshape(len(cheapest), n)
    totals = _sums(cost, ranked)
    ascending = np.lexsort((*ranked.T[::-1], totals))
    return Assignments(ranked[ascending], totals[ascending])


def _sums(cost: Array, columns: Indices) -> Array:
    """Return the costs (k,) of assignments (k, n), added row by row."""
    total = np.zeros(len(columns))
    for row, taken in zip(cost, columns.T, strict=True):
        total += row[taken]
    return total


def _cheapest(cost: Array) -> Indices | None:
    """Return the columns (n,) of the cheapest assignment, or None if there is none."""
    from scipy.optimize import linear_sum_assignment

    try:
        rows, columns = linear_sum_assignment(cost)
    except ValueError as error:
        if "infeasible" in str(error):
            return None
        raise
    return columns.astype(np.int64) if len(rows) == len(cost) else None


def best_joint(scores: Array, leaves: Indices, wanted: Indices) -> JointBest:
    """Return the best associations of each hypothesis, best first: its row (n,), what tracks take (n, t), the score (n,).

    scores (l, 1+k) of leaves, column 0 the miss; leaves (h, t): the leaf of each track in each hypothesis, -1 where it has
    none; wanted (h,): how many associations. What a track takes: 0 a miss, else a return counted from 1; one return goes to
    at most one track. The score is the sum of those of the leaves.
    """
    k = scores.shape[-1] - 1
    scores = np.array(scores)
    if k:
        scores[:, 0] = np.maximum(scores[:, 0], np.max(scores, axis=-1) - FARTHEST)
    contested = np.any(np.isfinite(scores[:, 1:]), axis=-1)
    origins, choices, totals = [], [], []
    for row, (members, most) in enumerate(zip(leaves, wanted, strict=True)):
        there = members >= 0
        open_ = np.flatnonzero(there & contested[members])
        rest = float(np.sum(scores[members[there & ~contested[members]], 0]))
        part = scores[members[open_]]
        cost = np.full((len(open_), k + len(open_)), np.inf)
        cost[:, :k] = -part[:, 1:]
        cost[range(len(open_)), range(k, k + len(open_))] = -part[:, 0]
        columns, costs = k_best(cost, int(most))
        choice = np.zeros((len(costs), len(members)), dtype=np.int64)
        choice[:, open_] = np.where(columns < k, columns + 1, 0)
        origins.append(np.full(len(costs), row))
        choices.append(choice)
        totals.append(rest - costs)
    return JointBest(np.concatenate(origins), np.concatenate(choices), np.concatenate(totals))
