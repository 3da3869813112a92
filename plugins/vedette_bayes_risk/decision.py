"""The global decision of a distributed detection: for a target, from the number of sensors on that makes the risk least."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import Costs, tails


@final
@frozen
class BayesRiskDecision(DistributedDetection):
    """Decides g = 1, for a target, on returns that k >= `best` sensors report, best = argmin R(k); the others are dropped.

    R(k) is the Bayes risk of deciding so, with P_D(k) and P_F(k) as in `bayes_risk_detection`. What is left weighs alike.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), section 2 and equation 1; Hoballah, Varshney,
    Distributed Bayesian Signal Detection, IEEE T-IT 35, 1989.
    """

    kind: ClassVar[str] = "bayes_risk_decision"

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def risks(self) -> Array:
        """Return R(k) for k = 1 .. N, (N,)."""
        return self.costs.risks(*tails(self.confirmation, self.threshold))

    @property
    def best(self) -> int:
        """The number of sensors that makes the risk least; 2 or more, as no single one decides."""
        return 2 + int(np.argmin(self.risks()[1:]))

    def least(self) -> int:
        """Return `best`."""
        return self.best

    def log_weights(self) -> Array:
        """Return zeros (N,)."""
        return np.zeros(len(self.sensors))
