"""The parallel filters' mixture as printed: without the spread of their means."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Traits, fields
from vedette.filters import GaussianFilter, Hypotheses, evaluate_linearised, predict_linearised


@final
@frozen
class ParallelKalmanPrinted(GaussianFilter):
    """One extended Kalman filter per return, x = sum w_i x_i and P = sum w_i P_i; kept for comparison.

    P lacks sum w_i (x_i - x)(x_i - x)': where returns compete, the filter is far too confident. `kalman` and `ekf` with
    the same associator include it.
    Kim, Choi, Ahn, Ko, on using Bayes risk for data association (in Korean), equation 6.
    """

    kind: ClassVar[str] = "parallel_kalman_printed"
    known_failures: ClassVar[Mapping[str, str]] = {
        "soft_weights_give_the_mixtures_moments": "the paper prints the covariance without the spread of the means"
    }
    misprint: ClassVar[str] = "equation 6: the covariance lacks the spread of the means"
    declares: ClassVar[Traits] = Traits(takes_frames=True)

    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief `dt` s later."""
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Compare every return with every track, linearised at its mean."""
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate)

    def update(self, belief: Gaussian, innovation: Innovation, weights: Array) -> Gaussian:
        """Weighted mean of the means, weighted mean of the covariances."""
        detail: Hypotheses = innovation.detail
        step = (weights[..., None, 1:] @ detail.shift)[..., 0, :]
        within = np.sum(weights[..., 1:, None, None] * detail.post, axis=-3)
        return Gaussian(self.state.displace(belief.mean, step), weights[..., :1, None] * belief.cov + within)
