"""The g-h filter, which is the alpha-beta filter, and the g-h-k filter."""

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
    new_innovation,
)
from vedette.filters import (
    GaussianFilter,
    Hypotheses,
    embedded,
    evaluate_linearised,
    extent_linearised,
    predict_linearised,
    prepare,
)


@final
@frozen
class GH(GaussianFilter):
    """A filter of constant gains, also known as the alpha-beta filter, and with k as alpha-beta-gamma.

    A residual nu changes the observed axes by g nu, their rates by h nu / T, the rates of these by 2 k nu / T^2. The
    pseudo-inverse of H converts nu to the axes that the sensor observes. The covariance is that of such a filter's errors,
    by Joseph's form P+ = (I - K H) P- (I - K H)' + K R K', which holds for any gain.
    Brookner, Tracking and Kalman Filtering Made Easy, 1998, sections 1.2 and 1.3.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantAcceleration, LinearSensor
    >>> estimator = GH(ConstantAcceleration(0.1, axes=("x",)), g=0.5, h=0.3, k=0.04, step=2.0)  # x, vx, ax
    >>> x, P = np.array([100.0, 5.0, 0.5]), np.array([[30.0, 2.0, 0.1], [2.0, 4.0, 0.2], [0.1, 0.2, 1.0]])
    >>> belief = estimator.start(Gaussian(x[None], P[None]), estimator.state, None)
    >>> seen = estimator.evaluate(belief, LinearSensor(("x",), [[25.0]]), Detections.of([[112.0]]), 1.0)
    >>> after = estimator.update(belief, seen, np.array([[0.0, 1.0]]))
    >>> after.mean[0].round(9).tolist()  # by 12 g, 12 h / 2 and 12 2 k / 2^2
    [106.0, 6.8, 0.74]
    >>> K, H = np.array([0.5, 0.15, 0.02]), np.array([1.0, 0.0, 0.0])
    >>> left = np.eye(3) - np.outer(K, H)
    >>> np.allclose(after.cov[0], left @ P @ left.T + 25.0 * np.outer(K, K))
    True
    >>> doubled = LinearSensor(("x",), [[25.0]], [[2.0]])  # z = 2 x: by the pseudo-inverse, half the residual
    >>> seen = estimator.evaluate(belief, doubled, Detections.of([[224.0]]), 1.0)
    >>> estimator.update(belief, seen, np.array([[0.0, 1.0]])).mean[0].round(9).tolist()
    [106.0, 6.8, 0.74]
    >>> F = np.array([[1.0, 2.0, 2.0], [0.0, 1.0, 2.0], [0.0, 0.0, 1.0]])
    >>> ahead = estimator.predict(belief, 2.0, None)
    >>> np.allclose(ahead.mean[0], F @ x), np.allclose(ahead.cov[0], F @ P @ F.T + estimator.motion.noise(x, 2.0))
    (True, True)
    """

    kind: ClassVar[str] = "g_h"
    abbreviations: ClassVar[tuple[str, ...]] = ("ghk", "alphabeta", "alphabetagamma")
    declares: ClassVar[Traits] = Traits(bounded=True)

    motion: MotionModel = fields.part("how the target moves: with velocities, or for k with accelerations too")
    g: float = fields.quantity("1", "gain of the observed axes", above=0, at_most=1)
    h: float = fields.quantity("1", "gain of its rate, times `step`", at_least=0)
    k: float = fields.quantity("1", "gain of its second rate, times `step` squared over 2", default=0.0, at_least=0)
    step: float = fields.quantity("s", "time between scans, T, that the gains are for", default=1.0, above=0)

    def __attrs_post_init__(self) -> None:
        if not self.h < 4 - 2 * self.g:
            raise ValueError(f"h: must be < 4 - 2 g = {4 - 2 * self.g:g}, or errors grow, got {self.h:g}")

    def predict(self, belief: Gaussian, dt: float, rng: np.random.Generator) -> Gaussian:
        return belief if dt == 0 else predict_linearised(belief, self.motion, dt, self._memo)

    def evaluate(self, belief: Gaussian, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each track, linearised at its mean, and what the constant gains make of it."""
        assert isinstance(observed, Detections)
        exact = evaluate_linearised(belief, self.state, sensor, observed, p_gate, self._memo)
        where = self.state.locate(sensor.observes)
        x = belief.mean[..., where]
        ready = prepare(sensor, observed, sensor.measure(x), sensor.noise(x))
        slope = sensor.jacobian(x)
        H = embedded(slope, where, len(self.state))
        H, P = ready.rows(H[..., None, :, :]), belief.cov[..., None, :, :]
        K = self._gains(where) @ (H[..., where] if _is_identity(slope) else _inverse(H[..., where], P, where))
        left = np.eye(len(self.state)) - K @ H
        post = left @ P @ np.swapaxes(left, -1, -2) + K @ ready.noise @ np.swapaxes(K, -1, -2)
        shift = (K @ ready.residuals[..., None])[..., 0]
        return new_innovation(
            exact.loglik, exact.distance, exact.log_volume, exact.nis, Hypotheses(shift, kernels.symmetric(post))
        )

    def extent(self, belief: Gaussian, sensor: Sensor, detections: Detections, limit: Array | float) -> tuple[Array, Array]:
        return extent_linearised(belief, self.state, sensor, detections, limit, self._memo)

    def _gains(self, where: list[int]) -> Array:
        """Return how residuals along the axes of indices `where` move the state: (n, len(where))."""
        names, gains = self.state.names, np.zeros((len(self.state), len(where)))
        for j, i in enumerate(where):
            gains[i, j] = self.g
            for name, gain in zip(_rates(names[i]), (self.h / self.step, 2 * self.k / self.step**2), strict=False):
                if name in names and name not in self.zero_variance:
                    gains[names.index(name), j] = gain
        return gains


def _is_identity(slope: Array) -> bool:
    return slope.ndim == 2 and slope.shape[0] == slope.shape[1] and bool(np.all(slope == np.eye(len(slope))))


def _inverse(slope: Array, P: Array, where: list[int]) -> Array:
    """Return the pseudo-inverse of H (*b, t, 1|k, m, n), with axes in their standard deviations so that no unit matters."""
    size = np.sqrt(np.maximum(np.diagonal(P, axis1=-2, axis2=-1)[..., where], 1e-300))
    return size[..., :, None] * np.linalg.pinv(slope * size[..., None, :])


def _rates(name: str) -> tuple[str, ...]:
    """Return the names of the first and the second rate of an axis."""
    if name.startswith("v"):
        return (f"a{name[1:]}",)
    return f"v{name}", f"a{name}"
