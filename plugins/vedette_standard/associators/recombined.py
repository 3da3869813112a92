"""The independent targets that are closest to a mixture of hypotheses, whichever target each of these calls which."""

from __future__ import annotations

import numpy as np

from vedette import Array, Gaussian, Indices, Merging, Space, kernels
from vedette.filters import merged
from vedette_standard.associators.hypotheses import GlobalHypotheses

CERTAIN = 1e-12
"""Existence is taken to be at least so far from 0 and from 1 where its logarithm is compared."""
UNLIKE = -1e6
"""The log density of any leaf under a target that has none."""


MOST_ROUNDS = 50
"""Rounds after which the search ends, though it may not have settled; few problems need ten."""


def merged_by_track(hypotheses: GlobalHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
    """Return one leaf for each track, `recombined`, with its past in the heaviest hypothesis that holds the track."""
    leaves = hypotheses.leaves
    shares = recombined(hypotheses, estimate, existence, state)
    own = leaves[np.argmax(leaves >= 0, axis=0), np.arange(leaves.shape[1])]
    return Merging(own, shares, GlobalHypotheses.of(leaves.shape[1]))


def recombined(hypotheses: GlobalHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Array:
    """Return the shares (t, l) in which t targets are made up of leaves with these estimates (l, n) and existence (l,).

    In turns, each target gets the moments of its leaves, and each hypothesis gives its leaves to the targets anew, such that
    the Kullback-Leibler divergence of the independent targets from the hypotheses falls. It starts from the heaviest
    hypothesis, and ends when nothing changes.
    """
    leaves, weights = hypotheses.leaves, hypotheses.weights
    held, count = leaves >= 0, leaves.shape[1]
    target = np.where(held, np.arange(count), -1)
    first = _shares(target[:1], leaves[:1], np.ones(1), len(existence))
    shares = np.where((leaves[0] >= 0)[:, None], first, _shares(target, leaves, weights, len(existence)))
    for _ in range(MOST_ROUNDS):
        gains = _gains(shares, estimate, existence, state)
        before = target
        taken = kernels.best_joint(gains, leaves, np.ones(len(leaves), dtype=np.int64))[1]
        target = np.where(held, taken - 1, -1)
        shares = _shares(target, leaves, weights, len(existence))
        if np.array_equal(before, target):
            break
    return shares


def _shares(target: Indices, leaves: Indices, weights: Array, count: int) -> Array:
    """Return the weight (t, l) of the hypotheses that give each of `count` leaves to each target."""
    shares, held = np.zeros((leaves.shape[1], count)), leaves >= 0
    np.add.at(shares, (target[held], leaves[held]), np.broadcast_to(weights[:, None], leaves.shape)[held])
    return shares


def _gains(shares: Array, estimate: Gaussian, existence: Array, state: Space) -> Array:
    """Return how much better each target explains a leaf than by being absent (l, 1+t); no leaf may go to column 0, to none.

    That is the mean over the leaf of the log of the target's Bernoulli density.
    """
    mass = shares * existence
    some = np.sum(mass, axis=-1)
    known = some > CERTAIN
    targets = merged(estimate, mass[known] / some[known, None], state)
    information = np.linalg.inv(targets.cov)
    apart = state.difference(estimate.mean[None], targets.mean[:, None])
    spread = np.einsum("tij,lij->tl", information, estimate.cov)
    spread += np.einsum("tli,tij,tlj->tl", apart, information, apart)
    log_density = np.full(shares.shape, UNLIKE)
    log_density[known] = -0.5 * (spread + np.linalg.slogdet(2 * np.pi * targets.cov)[1][:, None])
    probability = np.clip(some, CERTAIN, 1.0 - CERTAIN)[:, None]
    gains = existence * (np.log(probability) + log_density - np.log1p(-probability))
    return np.concatenate([np.full((1, shares.shape[1]), -np.inf), gains]).T
