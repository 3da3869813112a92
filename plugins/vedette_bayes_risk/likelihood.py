"""Returns weighted by the likelihood ratio of their confirmations."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_bayes_risk.fusion import DistributedDetection


@final
@frozen
class CountLikelihoodDetection(DistributedDetection):
    """Weights by log p(k | H1, k > 1) - log p(k | H0, k > 1), for any associator that adds evidence to its scores."""

    kind: ClassVar[str] = "count_likelihood_detection"

    def log_weights(self) -> Array:
        """Return the log-likelihood ratios (N,)."""
        pair = self.confirmation.given_target(self.threshold), self.confirmation.given_clutter(self.threshold)
        log = [np.log(np.maximum(p, 1e-300)) - np.log(max(float(np.sum(p[1:])), 1e-300)) for p in pair]
        ratio: Array = log[0] - log[1]
        return ratio
