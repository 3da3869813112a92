"""Associators that choose one return a track without joint sums."""

import numpy as np
from attrs import frozen

import vedette
from foreign import Foreign


def gains(scores):
    """Return how much better than a miss each return is (*b, t, k); -inf where it is forbidden."""
    best = np.max(scores, axis=-1, keepdims=True)
    return scores[..., 1:] - np.maximum(scores[..., :1], best - 500.0)


@frozen
class Greedy(vedette.Associator):
    """Suboptimal nearest neighbour: the best pair of all is taken, its track and return are struck out, and so on.

    A pair counts by its score over that of the track's miss; no pair below it is taken.
    Blackman, Multiple-Target Tracking with Radar Applications, 1986, chapter 4.
    """

    kind = "greedy"
    exclusive = True

    def associate(self, scores, evidence):
        left = gains(scores)
        weights = np.zeros(scores.shape)
        weights[..., 0] = 1.0
        t, k = left.shape[-2:]
        for _ in range(min(t, k)):
            flat = left.reshape(*left.shape[:-2], t * k)
            best = np.argmax(flat, axis=-1)
            found = np.take_along_axis(flat, best[..., None], axis=-1)[..., None] > 0
            track = (np.arange(t) == (best // k)[..., None])[..., None]
            column = (np.arange(k) == (best % k)[..., None])[..., None, :]
            weights[..., 1:] += track & column & found
            weights[..., :1] -= track & found
            left = np.where(track | column, -np.inf, left)
        return weights


@frozen
class StrongestNeighbour(vedette.Associator):
    """Probabilistic strongest neighbour: of the returns in the gate the one of most evidence, by the probability that it is
    the target's, g / (1 + g), g its likelihood over that of a miss. Among equals, and without evidence, the likeliest.

    Li, Zhi, PSNF: A Refined Strongest Neighbor Filter for Tracking in Clutter, Proc. IEEE CDC, 1996.
    """

    kind = "strongest_neighbour"

    def associate(self, scores, evidence):
        gain = gains(scores)
        if gain.shape[-1] == 0:
            return np.ones(scores.shape)
        strength = np.zeros_like(gain) if evidence is None else np.broadcast_to(evidence, gain.shape)
        strength = np.where(np.isfinite(gain), strength, -np.inf)
        first = strength == np.max(strength, axis=-1, keepdims=True)
        best = np.argmax(np.where(first, gain, -np.inf), axis=-1)[..., None]
        claim = (1 + np.tanh(np.take_along_axis(gain, best, axis=-1) / 2)) / 2
        claimed = np.where(np.arange(gain.shape[-1]) == best, claim, 0.0)
        return np.concatenate([1 - claim, claimed], axis=-1)


@frozen
class SharedNormaliser(vedette.Associator):
    """Joint association by sums over pairs: a return's weight competes with the misses, the track's other returns, and the
    other tracks' claims on the return, each claim by what its own track would leave it.

    w_ti = g_ti / (1 + sum_j g_tj) over 1 + sum of the others' claims on i; the rest is the miss.
    After Roecker, Phillis, Suboptimal Joint Probabilistic Data Association, IEEE T-AES 29, 1993.
    """

    kind = "shared_normaliser"
    exclusive = True

    def associate(self, scores, evidence):
        best = np.max(scores, axis=-1, keepdims=True)
        miss = np.exp(np.maximum(scores[..., :1] - best, -500.0))
        g = np.exp(scores[..., 1:] - best)
        alone = g / (miss + g.sum(axis=-1, keepdims=True))
        others = alone.sum(axis=-2, keepdims=True) - alone
        claimed = alone / (1 + others)
        claimed = claimed / np.maximum(claimed.sum(axis=-2, keepdims=True), 1.0)
        return np.concatenate([1 - claimed.sum(axis=-1, keepdims=True), claimed], axis=-1).clip(0.0)


COMPONENTS = (
    Foreign("greedy", "associator", Greedy),
    Foreign("strongest neighbour", "associator", StrongestNeighbour),
    Foreign("shared normaliser", "associator", SharedNormaliser),
)
