"""Returns weighted as printed in the paper."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import NO_RATIO, Costs


@final
@frozen
class BayesRiskPrinted(DistributedDetection):
    """Sums P_D(k) and P_F(k) over i <= k, which decides for a target where FEW sensors confirm; kept for comparison.

    p(k | H0) ~ C(N, k) P_FA^k, p(k | H1) ~ C(N, k) P_M^(N-k) (1 - P_M)^k over k = 1 ... N, with the means of P_FA and P_M
    over the sensors. The printed P_FA = A_v/(lambda A_1) exceeds 1 and has a unit; here it is 1 - exp(-lambda A_v).
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), equations 1 to 5.

    >>> from vedette import Detections, Scan
    >>> from vedette_standard import CartesianPosition
    >>> base, other = CartesianPosition(sigma=4.0), CartesianPosition(3.0, detection_probability=0.8, clutter_density=2e-4)
    >>> costs = Costs(miss=3.0, false_alarm=2.0, detection=0.5, rejection=0.25, prior=0.3)
    >>> weighs = BayesRiskPrinted({"b": base, "o": other}, base="b", threshold=12.0, costs=costs)
    >>> z = {"b": [[10.0, 20.0]], "o": [[13.0, 24.0]]}
    >>> made = weighs.process({name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()})
    >>> f, m = 1 - np.exp(-2e-4 * np.pi * 144), 1 - 0.8 * (1 - np.exp(-144 / (2 * (16 + 9))))
    >>> P_D, P_F = 2 * m / (2 * m + 1 - m), 2 / (2 + f)  # at k = 1; both are 1 at k = 2
    >>> R = [0.3 * (3.0 * (1 - P_D) + 0.5 * P_D) + 0.7 * (2.0 * P_F + 0.25 * (1 - P_F)), 0.3 * 0.5 + 0.7 * 2.0]
    >>> np.allclose(made.evidence, np.log(1 / R[0] + 1 / R[1]))
    True
    """

    kind: ClassVar[str] = "bayes_risk_printed"
    misprint: ClassVar[str] = "equations 2 and 4: summed from below, they decide for a target where few sensors confirm"
    known_failures: ClassVar[Mapping[str, str]] = NO_RATIO

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def log_weights(self) -> Array:
        """Return the log weights (N,)."""
        from scipy.special import comb

        count = len(self.sensors)
        k = np.arange(1, count + 1)
        p_false = float(np.mean(self.confirmation.false_alarm(self.threshold)))
        p_miss = float(np.mean(self.confirmation.miss(self.threshold)))
        shares = comb(count, k) * p_false**k, comb(count, k) * p_miss ** (count - k) * (1 - p_miss) ** k
        if not all(np.sum(share) > 0 for share in shares):
            raise ValueError("sensors: must have clutter and detect: without either, the printed probabilities are 0/0")
        against, for_target = (np.minimum(np.cumsum(share / np.sum(share)), 1.0) for share in shares)
        return self.costs.log_weights(for_target, against)
