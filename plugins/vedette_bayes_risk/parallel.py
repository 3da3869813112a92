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

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import LinearSensor, RandomWalk
    >>> estimator, sensor = ParallelKalmanPrinted(RandomWalk(2.0, axes=("x",))), LinearSensor(("x",), [[4.0]])
    >>> belief = estimator.start(Gaussian(np.array([[100.0]]), np.array([[[9.0]]])), estimator.state, None)
    >>> ahead = estimator.predict(belief, 0.75, None)  # 9 + 4 .75 = 12, S = 16, K = 3/4
    >>> seen = estimator.evaluate(ahead, sensor, Detections.of([[104.0], [96.0]]), 1.0)
    >>> after = estimator.update(ahead, seen, np.array([[0.25, 0.5, 0.25]]))
    >>> after.mean.round(9).tolist(), after.cov.round(9).tolist()  # 100 + .5 3 - .25 3; .25 12 + .75 3
    ([[100.75]], [[[5.25]]])
    """

    kind: ClassVar[str] = "parallel_kalman_printed"
    known_failures: ClassVar[Mapping[str, str]] = {
        "soft_weights_give_the_mixtures_moments": "the paper prints the covariance without the spread of the means"
    }
    misprint: ClassVar[str] = "equation 6: the covariance lacks the spread of the means"
    declares: ClassVar[Traits] = Traits(takes_frames=True)

    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
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
