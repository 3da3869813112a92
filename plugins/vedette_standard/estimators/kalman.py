"""The Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import (
    Array,
    Detections,
    Frame,
    Gaussian,
    Innovation,
    MotionModel,
    Sensor,
    Traits,
    fields,
    kernels,
    new_gaussian,
)
from vedette.filters import GaussianFilter, evaluate_linearised, extent_linearised, scan_step_linearised
from vedette.roles import GatedScan


@final
@frozen
class Kalman(GaussianFilter):
    """Exact for linear models with Gaussian noise; it refuses models that do not declare themselves linear.

    x- = F x, P- = F P F' + Q, S = H P- H' + R, K = P- H' S^-1, P+ = (I - K H) P- (I - K H)' + K R K'.
    Kalman, A New Approach to Linear Filtering and Prediction Problems, J. Basic Engineering 82, 1960.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, LinearSensor
    >>> x, P, R, T = np.array([[100.0, 5.0]]), np.array([[[30.0, 2.0], [2.0, 4.0]]]), 25.0, 2.0
    >>> F, Q = np.array([[1.0, T], [0.0, 1.0]]), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> estimator = Kalman(ConstantVelocity(0.3, axes=("x",)))
    >>> ahead = estimator.predict(estimator.start(Gaussian(x, P), estimator.state, None), T, None)
    >>> np.allclose(ahead.mean[0], F @ x[0]), np.allclose(ahead.cov[0], F @ P[0] @ F.T + Q)
    (True, True)
    >>> z, weights = np.array([104.0, 121.0]), np.array([[0.2, 0.5, 0.3]])
    >>> sensor = LinearSensor(("x",), [[R]], [[1.0]], (), 0.8)
    >>> seen = estimator.evaluate(ahead, sensor, Detections.of(z[:, None]), 0.9)
    >>> nu, S, K = z - ahead.mean[0, 0], ahead.cov[0, 0, 0] + R, ahead.cov[0, :, 0] / (ahead.cov[0, 0, 0] + R)
    >>> likely = 0.8 * np.exp(-0.5 * nu**2 / S) / np.sqrt(2.0 * np.pi * S)
    >>> np.allclose(seen.loglik[0], np.log([1.0 - 0.8 * 0.9, *likely]))
    True
    >>> after, step = estimator.update(ahead, seen, weights), weights[0, 1:] @ nu  # of a mixture
    >>> np.allclose(after.mean[0], ahead.mean[0] + K * step)
    True
    >>> np.allclose(after.cov[0], ahead.cov[0] + np.outer(K, K) * (weights[0, 1:] @ nu**2 - step**2 - 0.8 * S))
    True
    """

    kind: ClassVar[str] = "kalman"
    abbreviations: ClassVar[tuple[str, ...]] = ("kf", "information")
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, takes_frames=True, bounded=True)
    linearises: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves; a linear model")

    def __attrs_post_init__(self) -> None:
        if not self.motion.linear:
            raise ValueError(f"motion {self.motion.kind!r} is not linear: use the estimator 'ekf' or 'ukf' with it")

    def refuses(self, sensor: Sensor) -> str | None:
        """Refuse sensors that are not linear."""
        return None if sensor.linear else f"it is not linear: use the estimator 'ekf' or 'ukf' with {sensor.kind!r}"

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        if dt == 0:
            return belief
        x, memo = belief.mean, self._memo
        F, Q, periods = memo.steps.get(dt) or memo.step(self.motion, x, dt)
        ahead = kernels.predict(x, belief.cov, F, Q)
        return new_gaussian(self.state.canonical(ahead.mean), ahead.cov) if periods else ahead

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track."""
        return evaluate_linearised(belief, self.motion.state, sensor, observed, p_gate, self._memo)

    def scan_step(self, belief: Gaussian, scan: GatedScan) -> tuple[Gaussian, Array, Array] | None:
        """Return what a scan makes of runs of one track, in one kernel where the models are such."""
        return scan_step_linearised(belief, self.motion, scan, self._memo)

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(belief, self.motion.state, sensor, detections, limit, self._memo)
