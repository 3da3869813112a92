"""The Bayes risk of deciding for a target, and the paper's weight made of it."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, fields


@frozen
class Costs:
    """Cost of each decision: R = sum_ij C_ij P(decide i | j) P(j), j = 1 where there is a target."""

    miss: float = fields.quantity("1", "deciding against a target that is there", default=1.0)
    false_alarm: float = fields.quantity("1", "deciding for a target that is not there", default=1.0)
    detection: float = fields.quantity("1", "deciding for a target that is there", default=0.0)
    rejection: float = fields.quantity("1", "deciding against a target that is not there", default=0.0)
    prior: float = fields.probability("that a return of the base sensor is a target's", default=0.5, above=0, below=1)

    def log_weights(self, p_detect: Array, p_false: Array) -> Array:
        """Return log L(k), L(k) = sum over i <= k of 1/R(i), from the probabilities of deciding at count i or more: (N,)."""
        with_target = self.miss * (1 - p_detect) + self.detection * p_detect
        without = self.false_alarm * p_false + self.rejection * (1 - p_false)
        risk = with_target * self.prior + without * (1 - self.prior)
        if not np.all(risk > 0):
            k = int(np.argmin(risk))
            raise ValueError(f"costs: must make every Bayes risk > 0, got R({k + 1}) = {risk[k]:.6g}")
        log: Array = np.log(np.cumsum(1.0 / risk))
        return log
