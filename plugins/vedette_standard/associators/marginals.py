"""The marginals of the joint associations of one scan: of the best, and what these leave out, or of all."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vedette import Array, Branching, Mask, kernels
from vedette.hypotheses import LOST, JointHypotheses, LeafScores
from vedette.tracking import Pairs
from vedette_standard.associators.of_pairs import marginals_of_pairs


def best_associations(scores: LeafScores, most: int) -> Branching:
    """Return the `most` best joint associations of each cluster of tracks in one scan, as if there were no others."""
    return JointHypotheses.of(len(scores.miss)).grown(scores, np.zeros(scores.k, dtype=bool), most, 0.0)


def best_marginals(scores: LeafScores, most: int) -> tuple[Array, Array, Array]:
    """Return the marginals of the `most` best joint associations of each cluster of tracks, as if there were no others.

    They are the probability (t,) of each track's miss, that (p,) of each pair, and the probability (t,) of all other
    associations of the track's cluster, or a bound of it where the sum would take long.
    """
    grown = best_associations(scores, most)
    return marginals(scores, grown, grown.hypotheses.probability)


def marginals(scores: LeafScores, grown: Branching, probability: Array) -> tuple[Array, Array, Array]:
    """Return what `best_marginals` does, by the probability (l,) of each leaf of one scan's associations."""
    columns = 1 + scores.k
    misses, shares, lost = np.zeros(len(scores.miss)), np.zeros(len(scores.scores)), np.zeros(len(scores.miss))
    hit = grown.choice > 0
    misses[grown.parent[~hit]] = probability[~hit]
    pairs = scores.leaf * columns + 1 + scores.returns
    shares[np.searchsorted(pairs, grown.parent[hit] * columns + grown.choice[hit])] = probability[hit]
    if grown.lost is not None:
        lost[grown.parent] = grown.lost
    return kernels.normal_or_zero(misses), kernels.normal_or_zero(shares), lost


def joint_marginals(scores: LeafScores, exact: int) -> tuple[Array, Array, Mask]:
    """Return the marginals of all joint associations: misses (t,), pairs (p,), and whether (t,) they are approximations."""
    shares, misses, wide = marginals_of_pairs(scores.leaf, scores.returns, scores.scores, scores.miss, scores.k, exact)
    return misses, shares, wide


def marginals_of_table(
    scores: Array, most: int, of: Callable[[LeafScores, int], tuple[Array, Array, Array | Mask]] = best_marginals
) -> tuple[Array, Array]:
    """Return what `best_marginals` does by tables of log scores (*b, t, 1+k): weights (*b, t, 1+k) and what is lost (*b, t).

    `of`: what makes them of one run's, as `best_marginals` does.
    """
    weights, lost = np.zeros(scores.shape), np.zeros(scores.shape[:-1])
    for run in np.ndindex(scores.shape[:-2]):
        pairs = LeafScores.of(scores[run])
        weights[(*run, slice(None), 0)], shares, lost[run] = of(pairs, most)
        weights[run][pairs.leaf, 1 + pairs.returns] = shares
    return weights, lost


def of_each_pair(
    pairs: Pairs, most: int, of: Callable[[LeafScores, int], tuple[Array, Array, Array]] = best_marginals
) -> tuple[Array, Array, Mask]:
    """Return what `Associator.associate_pairs` does, of the `most` best joint associations of each cluster."""
    misses, shares, lost = of(pairs.by_leaf(), most)
    return shares, misses, lost > LOST


def left_out(scores: Array, m: int) -> Mask:
    """Return the tracks of clusters whose associations beyond the `m` best are too probable: (*b, t, 1+k) -> (*b, t)."""
    if np.max(np.sum(np.log1p(np.isfinite(scores[..., 1:]).sum(axis=-1)), axis=-1), initial=0.0) <= np.log(m):
        return np.zeros(scores.shape[:-1], dtype=bool)
    return marginals_of_table(scores, m)[1] > LOST
