"""Returns weighted by Bayes risk, with the noise that they have given the number of sensors that report them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import Costs, tails


@final
@frozen
class BayesRiskByCount(DistributedDetection):
    """As `bayes_risk_detection`, but R is that of the fused return given k: a low k says that the base erred.

    R = f(k) I / sum_j 1/v_j, f(k) = E[|error|^2 | k] over the one that k independent returns have. In the paper's scene f is
    5.4 at k = 2, and 1.4 at k = 6: with f = 1, as printed, one such return may throw a track off its target.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), where R = sigma^2 / k.
    """

    kind: ClassVar[str] = "bayes_risk_by_count"
    known_failures: ClassVar[Mapping[str, str]] = {
        "evidence_is_a_likelihood_ratio": "it is a weight of Bayes risk, for the associator `bayes_risk`"
    }

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def log_weights(self) -> Array:
        """Return the log weights (N,)."""
        return self.costs.log_weights(*tails(self.confirmation, self.threshold))

    def spread(self) -> Array:
        """Return f (N,)."""
        return self.confirmation.fused_error(self.threshold)
