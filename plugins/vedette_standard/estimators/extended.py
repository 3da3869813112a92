"""The extended Kalman filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Traits, fields
from vedette.filters import GaussianFilter, evaluate_linearised, extent_linearised, predict_linearised, scan_step_linearised
from vedette.roles import GatedScan


@final
@frozen
class ExtendedKalman(GaussianFilter):
    """Linearises motion and sensor at the current mean; the posterior covariance in Joseph's form.

    P- = F P F' + Q, S = H P- H' + R, K = P- H' S^-1, P+ = (I - K H) P- (I - K H)' + K R K'.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 10.3.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import CoordinatedTurn, RangeOnly
    >>> motion = CoordinatedTurn(0.5, 0.02)  # x, y, vx, vy, turn_rate
    >>> x, P = np.array([300.0, 400.0, 9.0, -4.0, 0.1]), np.diag([900.0, 400.0, 4.0, 9.0, 0.01])
    >>> estimator, F = ExtendedKalman(motion), motion.jacobian(x, 3.0)
    >>> ahead = estimator.predict(estimator.start(Gaussian(x[None], P[None]), motion.state, None), 3.0, None)
    >>> np.allclose(ahead.mean[0], motion.move(x, 3.0)), np.allclose(ahead.cov[0], F @ P @ F.T + motion.noise(x, 3.0))
    (True, True)
    >>> (px, py), P = ahead.mean[0, :2], ahead.cov[0]
    >>> H = np.array([px, py, 0.0, 0.0, 0.0]) / np.hypot(px, py)  # the derivative of the range
    >>> nu, S, K = 520.0 - np.hypot(px, py), H @ P @ H + 25.0, P @ H / (H @ P @ H + 25.0)
    >>> seen = estimator.evaluate(ahead, RangeOnly(5.0), Detections.of([[520.0]]), 1.0)
    >>> after = estimator.update(ahead, seen, np.array([[0.0, 1.0]]))
    >>> np.allclose(after.mean[0], ahead.mean[0] + K * nu), np.allclose(after.cov[0], P - np.outer(K, K) * S)
    (True, True)
    >>> np.allclose(seen.loglik[0, 1], -0.5 * (nu**2 / S + np.log(2.0 * np.pi * S)))
    True
    """

    kind: ClassVar[str] = "ekf"
    declares: ClassVar[Traits] = Traits(exact_when_linear=True, takes_frames=True, bounded=True)
    linearises: ClassVar[bool] = True

    motion: MotionModel = fields.part("how the target moves")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt, self._memo)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track, linearised at its mean."""
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate, self._memo)

    def scan_step(self, belief: Gaussian, scan: GatedScan) -> tuple[Gaussian, Array, Array] | None:
        """Return what a scan makes of runs of one track, in one kernel where the models are such."""
        return scan_step_linearised(belief, self.motion, scan, self._memo)

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(belief, self.state, sensor, detections, limit, self._memo)
