"""Returns weighted by the Bayes risk of deciding for a target at so many confirmations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import Costs, tails


@final
@frozen
class BayesRiskDetection(DistributedDetection):
    """Decides for a target from k sensors on: P_D(k) = sum over i >= k of p(i | H1), P_F(k) the same of p(i | H0).

    The weight is L(k) = sum over i <= k of 1/R(i). p(k | H1) accounts for the base's error, which all distances share,
    and p(k | H0) for a false return of the base, which is always counted. It is a weight for the associator `bayes_risk`,
    not a likelihood ratio: for `pda` use `count_likelihood_detection`.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), equations 1 to 5, corrected.
    """

    kind: ClassVar[str] = "bayes_risk_detection"
    known_failures: ClassVar[Mapping[str, str]] = {
        "evidence_is_a_likelihood_ratio": "it is a weight of Bayes risk, for the associator `bayes_risk`"
    }

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def log_weights(self) -> Array:
        """Return the log weights (N,)."""
        return self.costs.log_weights(*tails(self.confirmation, self.threshold))
