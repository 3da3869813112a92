"""A filter whose process noise adapts to its residuals."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, Sensor, Space, WrappedEstimator, fields
from vedette.filters import GaussianFilter, has_gaussian_belief


@frozen(eq=False)
class Monitored:
    """A Gaussian belief, and the factor (*b, t) on the process noise of the blocks."""

    belief: Gaussian
    scale: Array


@frozen(eq=False)
class MonitoredInnovation:
    """The filter's own detail, and NIS over the number of its axes (*b, t, k), capped."""

    detail: Any
    ratio: Array


@final
@frozen
class ResidualMonitored(WrappedEstimator[Monitored]):
    """A Gaussian filter with process noise D Q D, D = sqrt(a) on `blocks`: log a += gain * (NIS / m - 1), times the hit.

    On matched truth the mean of NIS / m is 1, so a stays near 1; where residuals exceed their covariance, a grows until
    they no longer do. NIS / m is limited to `most`, so that one outlier changes little. The filter's own prediction F P F'
    + Q gets D Q D - Q more, Q at the previous state. On the axes outside of `blocks` D is 1: noise that is known, as that of
    an atmosphere's jitter, must not grow with a manoeuvre, or the filter takes the manoeuvre for jitter.
    Maybeck, Stochastic Models, Estimation, and Control, vol. 2, 1982, section 10.8.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, Kalman, LinearSensor
    >>> inner = Kalman(ConstantVelocity(0.3, axes=("x",)))
    >>> estimator = ResidualMonitored(inner, gain=0.2, most=4.0, least=0.7, largest=3.0, blocks=("vx",))
    >>> prior = Gaussian(np.array([[100.0, 5.0]]), np.array([[[21.0, 2.0], [2.0, 4.0]]]))
    >>> sensor = LinearSensor(("x",), [[4.0]])
    >>> belief, scales = estimator.start(prior, estimator.state, None), []
    >>> for z in (110.0, 200.0, 100.0):  # NIS 100 / 25 and more count as 4, 0 as 0
    ...     seen = estimator.evaluate(belief, sensor, Detections.of([[z]]), 1.0)
    ...     scales.append(estimator.update(belief, seen, np.array([[0.25, 0.75]])).scale.item())
    >>> np.allclose(scales, np.exp([0.2 * 0.75 * 3.0, 0.2 * 0.75 * 3.0, -0.2 * 0.75]))
    True
    >>> seen = estimator.evaluate(belief, sensor, Detections.of([[107.5]]), 1.0)  # NIS 2.25
    >>> after = estimator.update(belief, seen, np.array([[0.0, 1.0]]))
    >>> ahead, own, a = estimator.predict(after, 2.0, None), inner.predict(after.belief, 2.0, None), np.exp(0.2 * 1.25)
    >>> D, Q = np.diag([1.0, np.sqrt(a)]), inner.motion.noise(prior.mean, 2.0)
    >>> np.allclose(after.scale, a), np.allclose(ahead.belief.cov[0], own.cov[0] + D @ Q @ D - Q)
    (True, True)
    >>> for z in (100.0, 200.0):  # between `least` and `largest`
    ...     one = belief
    ...     for _ in range(9):
    ...         seen = estimator.evaluate(one, sensor, Detections.of([[z]]), 1.0)
    ...         one = type(one)(prior, estimator.update(one, seen, np.array([[0.0, 1.0]])).scale)
    ...     print(round(float(one.scale[0]), 6))
    0.7
    3.0
    """

    kind: ClassVar[str] = "residual_monitored"
    drops: ClassVar[tuple[str, ...]] = ("exact_when_linear", "bounded")

    of: GaussianFilter = fields.part("the filter")
    gain: float = fields.quantity("1", "step of log a for NIS / m of 1 too much", default=0.05, at_least=0, at_most=1)
    most: float = fields.quantity("1", "NIS / m beyond this counts as this", default=5.0, above=1)
    least: float = fields.quantity("1", "the factor is at least this", default=0.1, above=0, at_most=1)
    largest: float = fields.quantity("1", "the factor is at most this", default=1000.0, at_least=1)
    blocks: tuple[str, ...] = fields.words("the axes whose noise adapts; none: all", default=())

    def __attrs_post_init__(self) -> None:
        if not has_gaussian_belief(self.of):
            raise ValueError(f"of: must be a filter whose belief is a mean and a covariance, got {self.of.kind!r}")
        if unknown := [name for name in self.blocks if name not in self.state]:
            raise ValueError(f"blocks: must be axes of {self.state}, got {unknown[0]!r}")

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Monitored:
        """Start the filter, with its noise as stated."""
        return Monitored(self.of.start(prior, axes, rng), np.ones(prior.mean.shape[:-1]))

    def reframe(self, belief: Monitored, combined: Gaussian) -> Monitored:
        """Return the filter's belief in the frame of the `combined` estimate."""
        return evolve(belief, belief=self.of.reframe(belief.belief, combined))

    def predict(self, belief: Monitored, dt: float, rng: np.random.Generator) -> Monitored:
        """Return the filter's prediction with scaled process noise."""
        if dt == 0:
            return belief
        ahead = self.of.predict(belief.belief, dt, rng)
        adapts = np.array([not self.blocks or name in self.blocks for name in self.state.names])
        root = np.where(adapts, np.sqrt(belief.scale)[..., None], 1.0)
        more = (root[..., :, None] * root[..., None, :] - 1.0) * self.of.motion.noise(belief.belief.mean, dt)
        return evolve(belief, belief=Gaussian(ahead.mean, ahead.cov + more))

    def evaluate(self, belief: Monitored, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Evaluate by the filter itself."""
        made = self.of.evaluate(belief.belief, sensor, observed, p_gate)
        ratio = np.clip(made.nis / len(sensor.measurement), 0.0, self.most)
        return evolve(made, detail=MonitoredInnovation(made.detail, ratio))

    def update(self, belief: Monitored, innovation: Innovation, weights: Array) -> Monitored:
        """Return the filter's posterior, and the updated factor."""
        detail: MonitoredInnovation = innovation.detail
        after = self.of.update(belief.belief, evolve(innovation, detail=detail.detail), weights)
        step = self.gain * np.sum(weights[..., 1:] * (detail.ratio - 1.0), axis=-1)
        return Monitored(after, np.clip(belief.scale * np.exp(step), self.least, self.largest))

    def moments(self, belief: Monitored) -> Gaussian:
        return belief.belief
