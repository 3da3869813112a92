"""The Bayes risk of deciding for a target, and the paper's weight made of it."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.counting import Confirmation

NO_RATIO: Mapping[str, str] = {
    "evidence_is_a_likelihood_ratio": "it is a weight of Bayes risk, for the associator `bayes_risk`"
}
"""The law that evidence by Bayes risk breaks, and why."""


@frozen
class Costs:
    """Cost of each decision: R = sum_ij C_ij P(decide i | j) P(j), j = 1 where there is a target."""

    miss: float = fields.quantity("1", "deciding against a target that is there", default=1.0)
    false_alarm: float = fields.quantity("1", "deciding for a target that is not there", default=1.0)
    detection: float = fields.quantity("1", "deciding for a target that is there", default=0.0)
    rejection: float = fields.quantity("1", "deciding against a target that is not there", default=0.0)
    prior: float = fields.probability("that a return of the base sensor is a target's", default=0.5, above=0, below=1)

    def risks(self, p_detect: Array, p_false: Array) -> Array:
        """Return R(k), the risk of deciding for a target from k sensors on, from the probabilities of doing so: (N,)."""
        with_target = self.miss * (1 - p_detect) + self.detection * p_detect
        without = self.false_alarm * p_false + self.rejection * (1 - p_false)
        risk = with_target * self.prior + without * (1 - self.prior)
        if not np.all(risk > 0):
            k = int(np.argmin(risk))
            raise ValueError(f"costs: must make every Bayes risk > 0, got R({k + 1}) = {risk[k]:.6g}")
        return risk

    def log_weights(self, p_detect: Array, p_false: Array) -> Array:
        """Return log L(k), L(k) = sum over i <= k of 1/R(i): (N,)."""
        return np.log(np.cumsum(1.0 / self.risks(p_detect, p_false)))


def tails(confirmation: Confirmation, threshold: float) -> tuple[Array, Array]:
    """Return P_D(k) and P_F(k), the probabilities that k sensors or more report a target and a false return, (N,) each."""
    given = confirmation.given_target(threshold), confirmation.given_clutter(threshold)
    over, false = (np.minimum(np.cumsum(p[::-1])[::-1], 1.0) for p in given)
    return over, false
