"""Returns weighted by the Bayes risk of deciding for a target at so many confirmations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import NO_RATIO, Costs, tails


@final
@frozen
class BayesRiskDetection(DistributedDetection):
    """Decides for a target from k sensors on: P_D(k) = sum over i >= k of p(i | H1), P_F(k) the same of p(i | H0).

    The weight is L(k) = sum over i <= k of 1/R(i). p(k | H1) accounts for the base's error, which all distances share,
    and p(k | H0) for a false return of the base, which is always counted. It is a weight for the associator `bayes_risk`,
    not a likelihood ratio: for `pda` use `count_likelihood_detection`.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), equations 1 to 5, corrected.

    >>> import numpy as np
    >>> from vedette import Detections, Scan
    >>> from vedette_standard import CartesianPosition
    >>> base, other = CartesianPosition(sigma=4.0), CartesianPosition(3.0, detection_probability=0.8, clutter_density=2e-4)
    >>> costs = Costs(miss=3.0, false_alarm=2.0, detection=0.5, rejection=0.25, prior=0.3)
    >>> weighs = BayesRiskDetection({"b": base, "o": other}, base="b", threshold=12.0, costs=costs)
    >>> z = {"b": [[90.0, 0.0], [10.0, 20.0]], "o": [[13.0, 24.0], [13.0, 9.0]]}  # R = 1 / (1/16 + 1/9), shares .36 and .64
    >>> made = weighs.process({name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()})
    >>> made.z.round(9).tolist(), made.noise.round(9).tolist()
    ([[11.92, 22.56]], [[[5.76, 0.0], [0.0, 5.76]]])
    >>> f = 1 - np.exp(-2e-4 * np.pi * 144)
    >>> d = 1 - (1 - 0.8 * (1 - np.exp(-144 / (2 * (16 + 9))))) * (1 - f)  # P_F(2), P_D(2); both are 1 at k = 1
    >>> R = [0.3 * 0.5 + 0.7 * 2.0, 0.3 * (3.0 * (1 - d) + 0.5 * d) + 0.7 * (2.0 * f + 0.25 * (1 - f))]
    >>> np.allclose(made.evidence, np.log(1 / R[0] + 1 / R[1]))
    True
    """

    kind: ClassVar[str] = "bayes_risk_detection"
    known_failures: ClassVar[Mapping[str, str]] = NO_RATIO

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def log_weights(self) -> Array:
        """Return the log weights (N,)."""
        return self.costs.log_weights(*tails(self.confirmation, self.threshold))
