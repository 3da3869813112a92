"""Joint probabilistic data association by message passing."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator, fields


@final
@frozen
class Jpda(Associator):
    """The marginal probabilities of joint associations in which no two tracks share a return, without enumerating them.

    Belief propagation between tracks and returns, on likelihood ratios l_ti = exp(score_ti - score_t0):
    m_ti = l_ti / (1 + sum_j!=i l_tj n_jt), n_it = 1 / (1 + sum_s!=t m_si); weights l_ti n_it / (1 + sum_j l_tj n_jt).
    It converges for every input, is exact where tracks and returns form a tree, and costs O(t k) a sweep, so that
    many crossing targets need no clusters.
    Williams, Lau, Approximate Evaluation of Marginal Association Probabilities with Belief Propagation,
    IEEE Trans. Aerospace and Electronic Systems 50, 2014.
    """

    kind: ClassVar[str] = "jpda"
    exclusive: ClassVar[bool] = True

    tolerance: float = fields.quantity("1", "largest change of a message at which to stop", default=1e-9, above=0)
    sweeps: int = fields.integer("most sweeps", default=1000, at_least=1)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """(*b, t, 1+k) -> (*b, t, 1+k)"""
        miss = np.maximum(scores[..., :1], np.max(scores, axis=-1, keepdims=True) - 500.0)  # a sure detection, kept finite
        ratio = np.exp(scores[..., 1:] - miss)
        to_track = np.ones_like(ratio)
        for _ in range(self.sweeps):
            likely = ratio * to_track
            # Sums without one's own term are taken as such: total - own would lose the small ones to rounding.
            to_return = ratio / (1.0 + _others(likely, -1))
            before, to_track = to_track, 1.0 / (1.0 + _others(to_return, -2))
            if np.max(np.abs(to_track - before), initial=0.0) < self.tolerance:
                break
        weights = np.empty_like(scores)
        likely = ratio * to_track
        weights[..., :1] = 1.0 / (1.0 + np.sum(likely, axis=-1, keepdims=True))
        weights[..., 1:] = likely * weights[..., :1]
        return weights


def _others(values: Array, axis: int) -> Array:
    """The sum over `axis` of all values but each one's own: (*b, t, k) -> (*b, t, k)"""
    count = values.shape[axis]
    if count < 2:
        return np.zeros_like(values)
    rows = np.moveaxis(values, axis, -1)
    before = np.zeros_like(rows)
    after = np.zeros_like(rows)
    before[..., 1:] = np.cumsum(rows[..., :-1], axis=-1)
    after[..., :-1] = np.cumsum(rows[..., :0:-1], axis=-1)[..., ::-1]
    return np.moveaxis(before + after, -1, axis)
