"""Returns weighted by Bayes risk, with the noise that they have given the number of sensors that report them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

from attrs import frozen

from vedette import Array, fields
from vedette_bayes_risk.fusion import DistributedDetection
from vedette_bayes_risk.risk import NO_RATIO, Costs, tails


@final
@frozen
class BayesRiskByCount(DistributedDetection):
    """As `bayes_risk_detection`, but R is that of the fused return given k: a low k says that the base erred.

    R = f(k) I / sum_j 1/v_j, f(k) = E[|error|^2 | k] over the one that k independent returns have. In the paper's scene f is
    5.4 at k = 2, and 1.4 at k = 6: with f = 1, as printed, one such return may throw a track off its target.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), where R = sigma^2 / k.

    >>> import numpy as np
    >>> from vedette import Detections, Scan
    >>> from vedette_standard import CartesianPosition
    >>> base, other = CartesianPosition(sigma=4.0), CartesianPosition(3.0, detection_probability=0.8, clutter_density=2e-3)
    >>> weighs = BayesRiskByCount({"b": base, "o": other}, base="b", threshold=9.0)
    >>> z = {"b": [[10.0, 20.0]], "o": [[13.0, 24.0]]}
    >>> made = weighs.process({name: Scan(0.0, name, Detections.of(each)) for name, each in z.items()})
    >>> rng = np.random.default_rng(1)  # draws of the errors at the base and of the nearest return there, true or false
    >>> e, true = 4.0 * rng.standard_normal((400_000, 2)), 3.0 * rng.standard_normal((400_000, 2))
    >>> far = np.where(rng.random(400_000) < 0.8, np.linalg.norm(true - e, axis=1), np.inf)
    >>> false, way = np.sqrt(rng.exponential(1 / (2e-3 * np.pi), 400_000)), rng.uniform(0, 2 * np.pi, 400_000)
    >>> near = np.where((far < false)[:, None], true, e + false[:, None] * np.stack([np.cos(way), np.sin(way)], axis=1))
    >>> fused = (0.36 * e + 0.64 * near)[np.minimum(far, false) < 9.0]
    >>> np.allclose(made.noise, np.eye(2) * np.mean(fused**2), rtol=0.01), np.allclose(made.z, [[11.92, 22.56]])
    (True, True)
    >>> f = 1 - np.exp(-2e-3 * np.pi * 81)
    >>> d = 1 - (1 - 0.8 * (1 - np.exp(-81 / (2 * (16 + 9))))) * (1 - f)
    >>> np.allclose(made.evidence, np.log(2.0 + 1 / (0.5 * (1 - d) + 0.5 * f)))
    True
    """

    kind: ClassVar[str] = "bayes_risk_by_count"
    known_failures: ClassVar[Mapping[str, str]] = NO_RATIO

    costs: Costs = fields.part("what each decision costs", default=Costs())

    def log_weights(self) -> Array:
        """Return the log weights (N,)."""
        return self.costs.log_weights(*tails(self.confirmation, self.threshold))

    def spread(self) -> Array:
        """Return f (N,)."""
        return self.confirmation.fused_error(self.threshold)
