"""Associators that sum over permanents, match once and for all, iterate a mean field, or keep the few nearest."""

from itertools import product

import numpy as np
from attrs import frozen
from scipy.optimize import linear_sum_assignment

import vedette
from foreign import Foreign
from foreign.associator_choice import gains

FORBIDDEN = 1e6


@frozen
class Permanents(vedette.Associator):
    """Exact joint association: all events are written down, and summed.

    w_ti is the share of events in which t takes i. Of many tracks these are more than anyone can wait for.
    Collins, Uhlmann, Efficient Gating in Data Association, IEEE T-AES 28, 1992.
    """

    kind = "permanents"
    exclusive = by_cluster = True

    @property
    def solves(self):
        return "marginals"

    def associate(self, scores, evidence):
        g = np.exp(scores - np.max(scores, axis=-1, keepdims=True))
        out = np.zeros(g.shape)
        for run in np.ndindex(*g.shape[:-2]):
            out[run] = self._one(g[run])
        return out

    def _one(self, g):
        t = len(g)
        weights = np.zeros(g.shape)
        for event in product(*(np.flatnonzero(row) for row in g)):
            taken = [i for i in event if i]
            if len(set(taken)) == len(taken):
                weights[np.arange(t), event] += np.prod(g[np.arange(t), event])
        return weights / weights.sum(axis=-1, keepdims=True) if t else weights


@frozen
class OnceForAll(vedette.Associator):
    """The likeliest joint association, by a linear assignment in which each track may also be missed.

    Jonker, Volgenant, A Shortest Augmenting Path Algorithm for Linear Assignment Problems, Computing 38, 1987.
    """

    kind = "once_for_all"
    exclusive = True
    decides = True

    @property
    def solves(self):
        return "best"

    def associate(self, scores, evidence):
        weights = np.zeros(scores.shape)
        t, k = scores.shape[-2], scores.shape[-1] - 1
        best = np.max(scores, axis=-1, keepdims=True)
        worth = np.clip(scores - best, -FORBIDDEN / 2, 0.0)
        worth = np.where(np.isfinite(scores), worth, -FORBIDDEN * 10)
        for run in np.ndindex(*scores.shape[:-2]):
            table = np.full((t, k + t), -FORBIDDEN * 10.0)
            table[:, :k] = worth[run][:, 1:]
            table[np.arange(t), k + np.arange(t)] = worth[run][:, 0]
            rows, columns = linear_sum_assignment(table, maximize=True)
            weights[(*run, rows, np.where(columns < k, columns + 1, 0))] = 1.0
        return weights


@frozen
class MeanField(vedette.Associator):
    """Belief propagation between tracks and returns, a fixed number of rounds.

    m_ti = g_ti / (1 + sum_{j != i} g_tj n_tj), n_ti = 1 / (1 + sum_{s != t} m_si); w_ti ~ g_ti n_ti.
    Williams, Lau, Approximate Evaluation of Marginal Association Probabilities with Belief Propagation, IEEE T-AES 50, 2014.
    """

    kind = "mean_field"
    exclusive = True
    rounds: int = vedette.fields.integer("of messages", default=200, at_least=150, at_most=300)

    def associate(self, scores, evidence):
        best = np.max(scores, axis=-1, keepdims=True)
        miss = np.exp(np.maximum(scores[..., :1] - best, -30.0))
        g = np.exp(scores[..., 1:] - best) / miss
        n = np.ones_like(g)
        for _ in range(self.rounds):
            claimed = g * n
            m = g / np.maximum(1.0 + claimed.sum(axis=-1, keepdims=True) - claimed, 1e-300)
            n = 1.0 / np.maximum(1.0 + m.sum(axis=-2, keepdims=True) - m, 1e-300)
        w = g * n
        weights = w / (1.0 + w.sum(axis=-1, keepdims=True))
        weights = weights / np.maximum(weights.sum(axis=-2, keepdims=True), 1.0)
        return np.concatenate([np.maximum(1.0 - weights.sum(axis=-1, keepdims=True), 0.0), weights], axis=-1)


@frozen
class TheNearest(vedette.Associator):
    """Probabilities of each track by itself over all of its returns that are within `nats` of its likeliest.

    Bar-Shalom, Tse, Tracking in a Cluttered Environment with Probabilistic Data Association, Automatica 11, 1975.
    """

    kind = "the_nearest"
    by_cluster = True
    nats: float = vedette.fields.quantity("1", "below the likeliest that are left out", default=25, at_least=20, at_most=60)

    def associate(self, scores, evidence):
        gain = np.concatenate([np.zeros_like(scores[..., :1]), gains(scores)], axis=-1)
        gain = gain - np.max(gain, axis=-1, keepdims=True)
        near = gain >= -self.nats
        near[..., 0] = np.isfinite(scores[..., 0])
        w = np.where(near, np.exp(np.where(near, gain, 0.0)), 0.0)
        return w / w.sum(axis=-1, keepdims=True)


COMPONENTS = (
    Foreign("permanents", "associator", Permanents),
    Foreign("once for all", "associator", OnceForAll),
    Foreign("mean field", "associator", MeanField),
    Foreign("the nearest", "associator", TheNearest),
)
