"""Weights of joint associations, of pairs (p,) of a track and a return within its gate: no table of all tracks and returns.

Pairs are by tracks, those of a track in any order; scores (p,) and misses (t,) are log scores, k the number of returns.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vedette import Array, Indices, Mask, kernels
from vedette_standard.compiled import fastest

MOST_MESSAGES = 200_000
"""Messages of belief propagation in a cluster and scan. Ended before it has settled, weights are off by less than
it is off by itself: in 300 targets 15 m apart, sigma 5 m, 150 sweeps and 1,000 covered as many.
"""


def marginals_of_pairs(
    tracks: Indices,
    returns: Indices,
    scores: Array,
    miss: Array,
    k: int,
    exact: int,
    tolerance: float = 1e-9,
    sweeps: int = 1000,
) -> tuple[Array, Array, Mask]:
    """Return the weights of pairs and misses over all joint associations, and the tracks (t,) of too wide clusters.

    A cluster that takes more than `exact` tracks or returns kept apart at once has its weights by belief propagation.
    """
    weights, misses, wide = summed(tracks, returns, scores, miss, k, exact)
    if wide.any():
        some = wide[tracks]
        weights[some], found = propagated(
            tracks[some], returns[some], scores[some], miss, k, tolerance, float(sweeps), float(MOST_MESSAGES)
        )
        misses[wide] = found[wide]
    return weights, misses, wide


@fastest
def summed(tracks: Indices, returns: Indices, scores: Array, miss: Array, k: int, most: int) -> tuple[Array, Array, Mask]:
    """Return the weights of pairs and misses, and the tracks of too wide clusters, as `kernels.joint_weights` does."""
    weights, misses, wide = np.zeros(len(tracks)), np.ones(len(miss)), np.zeros(len(miss), dtype=bool)
    for rows, pairs, at in _clusters(tracks, returns, len(miss), k):
        table = np.full((len(rows), 2 + int(at[1].max(initial=-1))), -np.inf)
        table[:, 0], table[at[0], 1 + at[1]] = miss[rows], scores[pairs]
        shares, wide[rows] = kernels.joint_weights(table, most)
        misses[rows], weights[pairs] = shares[:, 0], shares[at[0], 1 + at[1]]
    return weights, misses, wide


@fastest
def propagated(
    tracks: Indices, returns: Indices, scores: Array, miss: Array, k: int, tolerance: float, sweeps: float, messages: float
) -> tuple[Array, Array]:
    """Return the weights of pairs and misses by messages of tracks and returns, likelihood ratios l = exp(score - miss):
    m_ti = l_ti / (1 + sum_j!=i l_tj n_jt), n_it = 1 / (1 + sum_s!=t m_si), weights l_ti n_it / (1 + sum_j l_tj n_jt).

    It converges for every input, if slowly where as many returns as tracks are all nearly certain: a return that is
    still claimed more than once when the sweeps run out is shared out. `messages`: most of a cluster.
    Williams, Lau, Approximate Evaluation of Marginal Association Probabilities with Belief Propagation,
    IEEE Trans. Aerospace and Electronic Systems 50, 2014.
    """
    best = np.array(miss)
    np.maximum.at(best, tracks, scores)
    # An impossible miss is given a finite score: its weight is still 0, unless nothing else is left.
    ratios = np.exp(np.minimum(scores - np.maximum(miss, best - 3000.0)[tracks], 700.0))
    weights, misses = np.zeros(len(tracks)), np.ones(len(miss))
    for rows, pairs, at in _clusters(tracks, returns, len(miss), k):
        if not len(pairs):
            continue
        ratio, count = ratios[pairs], 1 + int(at[1].max())
        of_track, of_return = (at[0], kernels.places(at[0], len(rows))), (at[1], kernels.places(at[1], count))
        # From the scarcer side: all returns free to take, or all tracks.
        first = len(rows) <= count
        to_track = np.ones_like(ratio) if first else 1.0 / (1.0 + _others(ratio, of_return))
        for _ in range(int(min(sweeps, max(1, messages // len(pairs))))):
            # Sum without the own term rather than subtract it: total - own would lose small terms to rounding.
            to_return = ratio / (1.0 + _others(ratio * to_track, of_track))
            before, to_track = to_track, 1.0 / (1.0 + _others(to_return, of_return))
            if np.max(np.abs(to_track / before - 1.0)) <= tolerance:
                break
        likely = ratio * to_track
        missed = 1.0 / (1.0 + np.bincount(at[0], likely, len(rows)))
        claims = likely * missed[at[0]]
        shared = claims / np.maximum(1.0, np.bincount(at[1], claims, count))[at[1]]
        misses[rows], weights[pairs] = missed + np.bincount(at[0], claims - shared, len(rows)), shared
    return weights, misses


def _clusters(
    tracks: Indices, returns: Indices, t: int, k: int
) -> Iterator[tuple[Indices, Indices, tuple[Indices, Indices]]]:
    """Yield of each cluster its tracks, the numbers of its pairs, and in which of its rows and columns each lies."""
    labels = kernels.linked_clusters(tracks, returns, t, k)[:t]
    for label in np.unique(labels).tolist():
        rows, pairs = np.flatnonzero(labels == label), np.flatnonzero(labels[tracks] == label)
        columns = np.unique(returns[pairs])
        yield rows, pairs, (np.searchsorted(rows, tracks[pairs]), np.searchsorted(columns, returns[pairs]))


def _others(values: Array, at: tuple[Indices, Indices]) -> Array:
    """Return for each pair (p,) the sum of the values of its owner's other ones; `at`: owner and place among the owner's."""
    rows = np.zeros((int(at[0].max()) + 1, int(at[1].max()) + 2))
    before, after = np.zeros_like(rows), np.zeros_like(rows)
    rows[at] = values
    before[:, 1:] = np.cumsum(rows[:, :-1], axis=-1)
    after[:, :-1] = np.cumsum(rows[:, :0:-1], axis=-1)[:, ::-1]
    return (before + after)[at]
