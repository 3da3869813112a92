"""Associators between the nearest return and the joint probabilities of all."""

import numpy as np
from attrs import frozen
from scipy.optimize import linear_sum_assignment

import vedette
from foreign import Foreign


def likelihoods(scores):
    """Return the miss (*b, t, 1) and the returns (*b, t, k) over the best of each row; a miss is never quite impossible."""
    best = np.max(scores, axis=-1, keepdims=True)
    return np.exp(np.maximum(scores[..., :1] - best, -500.0)), np.exp(scores[..., 1:] - best)


@frozen
class Sinkhorn(vedette.Associator):
    """Weights w_ti = a_t g_ti b_i that share each return by scaling rows and columns in turn, clutter taking what is left.

    a_t = 1 / (g_t0 + sum_i g_ti b_i), b_i = 1 / (1 + sum_t a_t g_ti). They maximise the entropy-regularised assignment;
    what the last sweep leaves above 1 in a column goes to the misses.
    Sinkhorn, Diagonal Equivalence to Matrices with Prescribed Row and Column Sums, Am. Math. Monthly 74, 1967.
    """

    kind = "sinkhorn"
    exclusive = True
    sweeps: int = vedette.fields.integer("scalings of rows and columns", default=200, at_least=10, at_most=2000)

    def associate(self, scores, evidence):
        miss, g = likelihoods(scores)
        free = np.ones_like(g[..., :1, :])
        for _ in range(self.sweeps):
            rows = 1 / (miss + np.sum(g * free, axis=-1, keepdims=True))
            free = 1 / (1 + np.sum(rows * g, axis=-2, keepdims=True))
        rows = 1 / (miss + np.sum(g * free, axis=-1, keepdims=True))
        shared = rows * g * free
        shared = shared / np.maximum(shared.sum(axis=-2, keepdims=True), 1.0)
        return np.concatenate([1 - shared.sum(axis=-1, keepdims=True), shared], axis=-1).clip(0.0)


@frozen
class NearestJpda(vedette.Associator):
    """Each track takes one return or none, by the assignment with the greatest product of joint association probabilities.

    Those are summed over the sets of returns that are taken: forward over tracks, then backward.
    Fitzgerald, Track Biases and Coalescence with Probabilistic Data Association, IEEE T-AES 21, 1985.
    """

    kind = "nearest_jpda"
    exclusive = True

    def associate(self, scores, evidence):
        weights = np.zeros(scores.shape)
        if scores.shape[-2]:
            for run in np.ndindex(scores.shape[:-2]):
                weights[run] = self._choose(*likelihoods(scores[run]))
        return weights

    def _choose(self, miss, g):
        t, k = g.shape
        weights = np.zeros((t, 1 + k))
        cost = np.full((t, k + t), -1e6)
        with np.errstate(divide="ignore"):
            joint = np.maximum(np.log(self._marginals(miss, g)), -1e5)
        cost[:, :k] = np.where(g > 0, joint[:, 1:], -1e6)
        cost[np.arange(t), k + np.arange(t)] = joint[:, 0]
        rows, columns = linear_sum_assignment(cost, maximize=True)
        weights[rows, np.where(columns < k, columns + 1, 0)] = 1.0
        return weights

    def _marginals(self, miss, g):
        """Return the joint association probabilities (t, 1+k) of one cluster, by the sets of returns taken (2^k,)."""
        t, k = g.shape
        taken = np.arange(2**k)
        lacks = [taken[(taken >> i) & 1 == 0] for i in range(k)]
        before, after = np.zeros((t + 1, 2**k)), np.ones((t + 1, 2**k))
        before[0, 0] = 1.0
        for j in range(t):  # before: weight of all that leads to this set; after: of all that may follow it
            before[j + 1] = miss[j] * before[j]
            for i, sets in enumerate(lacks):
                before[j + 1, sets | (1 << i)] += g[j, i] * before[j, sets]
            before[j + 1] /= before[j + 1].max()
        for j in reversed(range(t)):
            after[j] = miss[j] * after[j + 1]
            for i, sets in enumerate(lacks):
                after[j, sets] += g[j, i] * after[j + 1, sets | (1 << i)]
            after[j] /= after[j].max()
        joint = np.zeros((t, 1 + k))
        for j in range(t):
            joint[j, 0] = miss[j, 0] * np.sum(before[j] * after[j + 1])
            for i, sets in enumerate(lacks):
                joint[j, 1 + i] = g[j, i] * np.sum(before[j, sets] * after[j + 1, sets | (1 << i)])
        return joint / joint.sum(axis=-1, keepdims=True)


COMPONENTS = (
    Foreign("Sinkhorn", "associator", Sinkhorn),
    Foreign("nearest-neighbour JPDA", "associator", NearestJpda),
)
