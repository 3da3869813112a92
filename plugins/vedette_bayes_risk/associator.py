"""Association weights that come from the detection stage alone."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Associator


@final
@frozen
class BayesRisk(Associator):
    """Weights each return in the gate by exp(evidence), normalised, wherever it lies there; without any, the track coasts.

    These are the weights of a bank of parallel filters, one per return, whose mixture the estimator takes. Without evidence
    all weights are equal. Positions matter to the gate only, so a PDA with a likelihood ratio as evidence uses more data.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), equation 6.

    >>> scores = np.array([[0.7, -3.0, 5.0, -np.inf], [0.7, -np.inf, -np.inf, -np.inf]])
    >>> evidence = np.log([[1.0, 3.0, 9.0]])
    >>> BayesRisk().associate(scores, evidence).round(9).tolist()  # whatever the scores; outside of the gate none
    [[0.0, 0.25, 0.75, 0.0], [1.0, 0.0, 0.0, 0.0]]
    >>> BayesRisk().associate(scores, None).tolist()
    [[0.0, 0.5, 0.5, 0.0], [1.0, 0.0, 0.0, 0.0]]
    """

    kind: ClassVar[str] = "bayes_risk"

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the weights: (*b, t, 1+k), evidence (*b, 1, k) -> (*b, t, 1+k)."""
        inside = np.isfinite(scores[..., 1:])
        log = np.where(inside, 0.0 if evidence is None else evidence, -np.inf)
        top = np.max(log, axis=-1, keepdims=True, initial=-np.inf)
        possible = np.isfinite(top)
        likely = np.where(inside, np.exp(log - np.where(possible, top, 0.0)), 0.0)
        weights = np.zeros_like(scores)
        weights[..., 1:] = likely / np.where(possible, np.sum(likely, axis=-1, keepdims=True), 1.0)
        weights[..., :1] = np.where(possible, 0.0, 1.0)
        return weights
