"""Joint associations: the best ways for the tracks of many hypotheses to share out a scan's returns."""

from __future__ import annotations

import numpy as np

from vedette.kernels.assignment import k_best
from vedette.kernels.results import JointBest
from vedette.space import Array, Indices

FARTHEST = 3000.0
"""An impossible miss scores this much below the best of its row: so something is left where nothing else is possible."""


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
