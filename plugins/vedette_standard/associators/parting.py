"""Clusters of hypotheses that part where this changes less than truncation would."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette import Array, Branching, Indices, Mask, kernels
from vedette.hypotheses import LOST, JointHypotheses, LeafScores, firsts

LESS = 0.1
"""So much of the probability that truncation drops may a link change that is cut. Chosen on a drawn scene of twelve targets,
P_D .5 and 100 false returns a scan: GOSPA 65 m by `k_best`, 74 m with .3, 159 m if none is cut.
"""

MOST = 10_000
"""Numbers that shared returns may have: where hundreds of tracks share hundreds, each would keep its hypotheses over all."""

LEAST = 1e-150
"""Whose square is not 0: clusters of which truncation drops nothing stay together, however little they claim."""


def grown_apart(hypotheses: JointHypotheses, scores: LeafScores, begins: Mask, most: int, least: float) -> Branching:
    """Return what `JointHypotheses.grown` does, with clusters apart where truncation would change more than that.

    Let q_c(i) be the probability that cluster c takes return i, were each of its leaves alone. If c and d took their returns
    regardless of each other, both would take one with a probability of at most l = sum_i q_c(i) q_d(i), and that they may
    not changes their joint probabilities by no more, in total variation. Where so many hypotheses are dropped that they have
    `lost` of a cluster's probability, clusters with l < `LESS` lost f_c f_d are not joined: each may take the return, and
    a track begins where the one does not that claims it most. f_c = 1 - sum_d l, or 0: a cluster that others drive from
    what it would take may take anything. A single hypothesis is the best joint association, and stays it.
    """
    whole = hypotheses.grown(scores, begins, most, least)
    if whole.lost is None or most == 1:
        return whole
    old, cluster = whole.parent >= 0, hypotheses.cluster_of
    lost = np.zeros(1 + int(np.max(cluster)))
    np.maximum.at(lost, cluster[whole.parent[old]], whole.lost[old])
    apart, returns = parted(hypotheses, scores, np.where(lost > LOST, LESS * lost, 0.0))
    if apart.k == scores.k or apart.k > MOST:
        return whole
    after = hypotheses.grown(apart, np.append(begins, np.zeros(apart.k - scores.k, dtype=bool)), most, least)
    return evolve(after, choice=np.append(0, 1 + returns)[after.choice])


def parted(hypotheses: JointHypotheses, scores: LeafScores, most: Array) -> tuple[LeafScores, Indices]:
    """Return the scores with numbers of their own for returns shared by clusters that part, and the return of each number.

    most (c,): what l / (f_c f_d) of a cluster's links must be below to be cut.
    """
    from scipy.sparse import csr_array

    leaf, cluster = scores.leaf, hypotheses.cluster_of[scores.leaf]
    pairs = _claims(hypotheses, scores)
    claims = csr_array((pairs, (cluster, scores.returns)), shape=(len(most), scores.k))
    both = (claims @ claims.T).tocoo()
    others = np.where(both.row == both.col, 0.0, both.data)
    free = 1.0 - np.minimum(np.bincount(both.row, others, len(most)), 1.0)
    joined = both.data >= (np.minimum(most[both.row], most[both.col]) * free[both.row] * free[both.col])
    row, column = (side[joined].astype(np.intp) for side in (both.row, both.col))
    part = kernels.linked_clusters(row, column, len(most), len(most))[: len(most)]
    parts = 1 + int(np.max(part))
    # Of the parts that share a return, the one that claims it most keeps its number.
    code, which = np.unique(scores.returns * parts + part[cluster], return_inverse=True)
    returns = code // parts
    order = np.lexsort((-np.bincount(which, pairs), returns))
    twice = np.sort(order[~firsts(returns[order])])
    number = returns.copy()
    number[twice] = scores.k + np.arange(len(twice))
    order = np.lexsort((number[which], leaf))
    apart = LeafScores(scores.miss, scores.ends, number[which][order], scores.scores[order], scores.k + len(twice))
    return apart, np.append(np.arange(scores.k), returns[twice])


def _claims(hypotheses: JointHypotheses, scores: LeafScores) -> Array:
    """Return the probability of each pair (p,), were each leaf of a hypothesis alone."""
    leaf, total = scores.leaf, np.array(scores.miss)
    np.logaddexp.at(total, leaf, scores.scores)
    sums = np.bincount(hypotheses.rows, total[hypotheses.leaves], len(hypotheses.weights))
    weight = np.log(hypotheses.weights) + sums
    best = np.maximum.reduceat(weight, np.flatnonzero(firsts(hypotheses.cluster)))
    likely = np.exp(weight - best[hypotheses.cluster])
    share: Array = likely / np.bincount(hypotheses.cluster, likely)[hypotheses.cluster]
    held = np.bincount(hypotheses.leaves, share[hypotheses.rows], len(total))
    return np.maximum(held[leaf] * np.exp(scores.scores - total[leaf]), LEAST)
