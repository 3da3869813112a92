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

    >>> from scipy.special import chndtr
    >>> from vedette import Detections, Scan
    >>> from vedette_standard import CartesianPosition
    >>> base, other = CartesianPosition(sigma=4.0), CartesianPosition(3.0, detection_probability=0.9, clutter_density=1e-3)
    >>> sensors, costs = {"b": base, "o": other, "p": other}, Costs(miss=2.0, false_alarm=9.0, prior=0.4)
    >>> decides = BayesRiskDecision(sensors, base="b", threshold=12.0, costs=costs)
    >>> u, f = -np.log((np.arange(20000) + 0.5) / 20000), 1 - np.exp(-1e-3 * np.pi * 144)
    >>> c = 1 - (1 - 0.9 * chndtr(144 / 9, 2, 2 * 16 * u / 9)) * (1 - f)  # that one confirms, given e^2 = 2 v_base u
    >>> P_D, P_F = np.array([1.0, 1 - np.mean((1 - c) ** 2), np.mean(c**2)]), np.array([1.0, 1 - (1 - f) ** 2, f**2])
    >>> np.allclose(decides.risks(), 0.4 * 2.0 * (1 - P_D) + 0.6 * 9.0 * P_F, rtol=1e-3), decides.best
    (True, 3)
    >>> z = {"b": [[0.0, 0.0], [60.0, 0.0]], "o": [[1.0, 0.0], [62.0, 3.0]], "p": [[0.0, 4.0], [90.0, 0.0]]}
    >>> made = decides.process({name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()})
    >>> made.z.round(9).tolist(), made.evidence.tolist()  # of shares 9/41 and twice 16/41
    ([[0.390243902, 1.56097561]], [0.0])
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
