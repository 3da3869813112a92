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
    """Weights by log p(k | H1, k > 1) - log p(k | H0, k > 1), for any associator that adds evidence to its scores.

    >>> from scipy.special import chndtr
    >>> from vedette import Detections, Scan
    >>> from vedette_standard import CartesianPosition
    >>> base, other = CartesianPosition(sigma=4.0), CartesianPosition(3.0, detection_probability=0.8, clutter_density=2e-4)
    >>> ratios = CountLikelihoodDetection({"b": base, "o": other, "p": other}, base="b", threshold=9.0)
    >>> z = {"b": [[0.0, 0.0], [60.0, 0.0]], "o": [[1.0, 0.0], [62.0, 3.0]], "p": [[0.0, 2.0], [90.0, 0.0]]}
    >>> made = ratios.process({name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()})
    >>> u = -np.log((np.arange(20000) + 0.5) / 20000)  # e^2 / (2 v_base), evenly over its distribution
    >>> f = 1 - np.exp(-2e-4 * np.pi * 81)
    >>> c = 1 - (1 - 0.8 * chndtr(81 / 9, 2, 2 * 16 * u / 9)) * (1 - f)  # that one confirms a target's
    >>> target, chance = [np.mean(c**2), np.mean(2 * c * (1 - c))], [f**2, 2 * f * (1 - f)]
    >>> np.allclose(made.evidence, np.log(target / np.sum(target)) - np.log(chance / np.sum(chance)), atol=1e-3)
    True
    """

    kind: ClassVar[str] = "count_likelihood_detection"

    def log_weights(self) -> Array:
        """Return the log-likelihood ratios (N,)."""
        pair = self.confirmation.given_target(self.threshold), self.confirmation.given_clutter(self.threshold)
        log = [np.log(np.maximum(p, 1e-300)) - np.log(max(float(np.sum(p[1:])), 1e-300)) for p in pair]
        return log[0] - log[1]
