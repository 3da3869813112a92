"""The H-infinity filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Traits, fields, kernels
from vedette.filters import GaussianFilter, evaluate_linearised, extent_linearised, predict_linearised

MOST = 0.99
"""The largest share of a track's information that a step takes away: its standard deviations grow at most tenfold."""


@final
@frozen
class HInfinity(GaussianFilter):
    """Bounds the worst-case error instead of the mean square error, for noises of unknown distribution.

    P- = ((F P F' + Q)^-1 - theta W T / step)^-1, with W the diagonal matrix of `weight`, which is large for the axes to be
    estimated well. The update is the Kalman filter's, linearised. The sum of squared errors, weighted by W, then stays
    below 1 / theta times that of all noises, each weighted by its inverse covariance. With theta = 0 it is `ekf`. Where
    theta is so large that there is no such bound, it is lowered for that step.
    Simon, Optimal State Estimation, 2006, section 11.3.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, LinearSensor
    >>> x, P, T = np.array([100.0, 5.0]), np.array([[30.0, 2.0], [2.0, 4.0]]), 3.0
    >>> F, Q = np.array([[1.0, T], [0.0, 1.0]]), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> estimator = HInfinity(ConstantVelocity(0.3, axes=("x",)), theta=0.002, weight={"x": 1.0, "vx": 5.0}, step=2.0)
    >>> ahead = estimator.predict(estimator.start(Gaussian(x[None], P[None]), estimator.state, None), T, None)
    >>> less = np.linalg.inv(np.linalg.inv(F @ P @ F.T + Q) - 0.002 * np.diag([1.0, 5.0]) * T / 2.0)
    >>> np.allclose(ahead.mean[0], F @ x), np.allclose(ahead.cov[0], less)
    (True, True)
    >>> seen = estimator.evaluate(ahead, LinearSensor(("x",), [[25.0]]), Detections.of([[125.0]]), 1.0)
    >>> after, K = estimator.update(ahead, seen, np.array([[0.0, 1.0]])), less[:, 0] / (less[0, 0] + 25.0)
    >>> np.allclose(after.mean[0], F @ x + K * 10.0), np.allclose(after.cov[0], less - np.outer(K, less[0]))
    (True, True)
    >>> greedy = HInfinity(estimator.motion, theta=9.0, weight={"x": 1.0, "vx": 5.0})  # beyond any bound: it is lowered
    >>> far = greedy.predict(Gaussian(x[None], P[None]), T, None).cov[0]
    >>> bool(np.all(np.linalg.eigvalsh(far) > 0.0)), bool(far[0, 0] < 100.01 * (F @ P @ F.T + Q)[0, 0])
    (True, True)
    """

    kind: ClassVar[str] = "h_infinity"
    abbreviations: ClassVar[tuple[str, ...]] = ("hinf",)
    declares: ClassVar[Traits] = Traits(takes_frames=True, bounded=True, conservative=True)

    motion: MotionModel = fields.part("how the target moves")
    theta: float = fields.quantity("1", "inverse of the bound on the worst error", at_least=0, tried=(0.0, 1e-3, 1e-2))
    weight: dict[str, float] = fields.table(
        "state axis to its weight W, in 1 over its unit squared", at_least=0, tried=({"x": 1.0, "vy": 0.1},)
    )
    step: float = fields.quantity("s", "time that theta is for", default=1.0, above=0)

    def __attrs_post_init__(self) -> None:
        for name in self.weight:
            if name not in self.state:
                raise ValueError(f"weight.{name}: there is no such axis; those are {', '.join(self.state.names)}")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the belief `dt` s later, less sure of what is weighted."""
        if dt == 0:
            return belief
        ahead = predict_linearised(belief, self.motion, dt, self._memo)
        weights = np.array([self.weight.get(name, 0.0) for name in self.state.names])
        return Gaussian(ahead.mean, _less_sure(ahead.cov, self.theta * dt / self.step * weights))

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track, linearised at its mean."""
        return evaluate_linearised(belief, self.state, sensor, observed, p_gate, self._memo)

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(belief, self.state, sensor, detections, limit, self._memo)


def _less_sure(cov: Array, taken: Array) -> Array:
    """Return (P^-1 - diag(taken))^-1 of covariances (*b, n, n), P = L L': L (I - L' diag(taken) L)^-1 L'."""
    root = kernels.root(cov)
    share, turn = np.linalg.eigh(np.swapaxes(root, -1, -2) @ (taken[:, None] * root))
    wide = root @ (turn / np.sqrt(1.0 - np.minimum(share, MOST))[..., None, :])
    return kernels.symmetric(wide @ np.swapaxes(wide, -1, -2))
