"""A Kalman filter that forgets old returns."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Traits, fields, new_gaussian
from vedette.filters import GaussianFilter, evaluate_linearised, extent_linearised, fading, predict_linearised


@final
@frozen
class FadingMemory(GaussianFilter):
    """The extended Kalman filter that gives old returns less weight: P- = a^2 F P F' + Q, with a = alpha^(T / step).

    For motion that the model does not describe: a return that is T s old has a^-2 times the weight that it has in `ekf`.
    With alpha = 1 it is `ekf`. A gap takes no variance beyond 1e30, where nothing is remembered.
    Simon, Optimal State Estimation, 2006, section 7.4.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, LinearSensor
    >>> x, P, T = np.array([100.0, 5.0]), np.array([[30.0, 2.0], [2.0, 4.0]]), 3.0
    >>> F, Q = np.array([[1.0, T], [0.0, 1.0]]), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> estimator = FadingMemory(ConstantVelocity(0.3, axes=("x",)), alpha=1.1, step=2.0)  # a^2 = 1.1^3 over 3 s
    >>> belief = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    >>> ahead = estimator.predict(belief, T, None)
    >>> np.allclose(ahead.mean[0], F @ x), np.allclose(ahead.cov[0], 1.331 * F @ P @ F.T + Q)
    (True, True)
    >>> np.allclose(estimator.cross_covariance(belief, T)[0], 1.331 * P @ F.T)
    True
    >>> seen = estimator.evaluate(ahead, LinearSensor(("x",), [[25.0]]), Detections.of([[125.0]]), 1.0)
    >>> after, K = estimator.update(ahead, seen, np.array([[0.0, 1.0]])), ahead.cov[0, :, 0] / (ahead.cov[0, 0, 0] + 25.0)
    >>> np.allclose(after.mean[0], F @ x + K * 10.0), np.allclose(after.cov[0], ahead.cov[0] - np.outer(K, ahead.cov[0, 0]))
    (True, True)
    """

    kind: ClassVar[str] = "fading_memory"
    declares: ClassVar[Traits] = Traits(takes_frames=True, bounded=True, conservative=True)

    motion: MotionModel = fields.part("how the target moves")
    alpha: float = fields.quantity(
        "1", "growth of the standard deviations in a step beside that of the motion", at_least=1, tried=(1.0, 1.01, 1.1)
    )
    step: float = fields.quantity("s", "time in which they grow by alpha", default=1.0, above=0)

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        if dt == 0:
            return belief
        return predict_linearised(new_gaussian(belief.mean, self._faded(belief, dt)), self.motion, dt, self._memo)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track, linearised at its mean."""
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate, self._memo)

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(belief, self.state, sensor, detections, limit, self._memo)

    def cross_covariance(self, belief: Gaussian, dt: float) -> Array:
        """Return a^2 P F', F the derivative of the motion at the mean."""
        return self._faded(belief, dt) @ np.swapaxes(self.motion.jacobian(belief.mean, dt), -1, -2)

    def _faded(self, belief: Gaussian, dt: float) -> Array:
        """Return a^2 P."""
        variances = np.diagonal(belief.cov, axis1=-2, axis2=-1)
        return fading(variances, 2 * dt / self.step * math.log(self.alpha))[..., None, None] * belief.cov
