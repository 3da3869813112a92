"""Least squares, recursively."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Detections, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, Traits, WrappedMotion, fields
from vedette.filters import OverMotion, fading
from vedette_standard.estimators.square_root import Root, SquareRootKalman


@final
@frozen
class Noiseless(WrappedMotion):
    """The motion of a target that keeps to its trajectory: that of another model, without its noise."""

    kind: ClassVar[str] = "noiseless"

    of: MotionModel = fields.part("the motion")

    def noise(self, x: Array, dt: float) -> Array:
        """Return 0 (n, n)."""
        return np.zeros((len(self.state), len(self.state)))


def _without_noise(estimator: LeastSquares) -> Noiseless:
    return Noiseless(estimator.trajectory)


def _filter(estimator: LeastSquares) -> SquareRootKalman:
    return SquareRootKalman(estimator.motion)


@final
@frozen
class LeastSquares(OverMotion[Root]):
    """Fits one trajectory to all returns of a track's life, each weighted by its noise: no noise of the motion, P- = F P F'.

    With `forgetting` L < 1, a return that is T old weighs L^(T / step) of a new one: P- = L^(-T / step) F P F'. The prior of
    a track counts like a return. A gap takes no variance beyond 1e30, where nothing is remembered. The filter keeps a square
    root of the covariance, so the prior may be very wide.
    Zarchan, Musoff, Fundamentals of Kalman Filtering: A Practical Approach, 2009, chapter 3.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import ConstantVelocity, LinearSensor
    >>> times, z = np.array([0.0, 1.0, 3.0, 4.0]), np.array([10.0, 13.0, 15.0, 21.0])
    >>> sensor = LinearSensor(("x",), [[4.0]])
    >>> for forgetting in (1.0, 0.9):
    ...     estimator = LeastSquares(ConstantVelocity(0.3, axes=("x",)), forgetting=forgetting, step=2.0)
    ...     belief = estimator.start(Gaussian(np.zeros((1, 2)), 1e12 * np.eye(2)[None]), estimator.state, None)
    ...     for dt, value in zip(np.diff(times, prepend=0.0), z, strict=True):
    ...         ahead = estimator.predict(belief, float(dt), None)
    ...         seen = estimator.evaluate(ahead, sensor, Detections.of([[value]]), 1.0)
    ...         belief = estimator.update(ahead, seen, np.array([[0.0, 1.0]]))
    ...     A, w = np.stack([np.ones(4), times - 4.0], axis=1), forgetting ** ((4.0 - times) / 2.0) / 4.0
    ...     after, P = estimator.moments(belief), np.linalg.inv((w * A.T) @ A)  # a line through all
    ...     np.allclose(after.mean[0], P @ (w * A.T) @ z), np.allclose(after.cov[0], P), estimator.declares.conservative
    (True, True, False)
    (True, True, True)
    """

    kind: ClassVar[str] = "least_squares"
    abbreviations: ClassVar[tuple[str, ...]] = ("rls",)

    trajectory: MotionModel = fields.part("how the target moves; its noise is left out")
    forgetting: float = fields.probability("weight of a return `step` old, relative to a new one", default=1.0, above=0)
    step: float = fields.quantity("s", "time that `forgetting` is for", default=1.0, above=0)
    motion: MotionModel = field(init=False, repr=False, eq=False, default=Factory(_without_noise, takes_self=True))
    _roots: SquareRootKalman = field(init=False, repr=False, eq=False, default=Factory(_filter, takes_self=True))

    def __attrs_post_init__(self) -> None:
        if self.trajectory.reframes:
            raise ValueError(f"trajectory: {self.trajectory.kind!r} turns its frame with its target, so it is not one")

    @property
    def declares(self) -> Traits:
        """Exact where it forgets nothing; else its covariance is larger than that of the errors."""
        return Traits(exact_when_linear=self.forgetting == 1.0, conservative=self.forgetting < 1.0)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Root:
        """Return the prior's marginal over the axes, its covariance as a root."""
        return self._roots.start(prior, axes, rng)

    def predict(self, belief: Root, dt: float, rng: np.random.Generator) -> Root:
        return self._roots.predict(self._faded(belief, dt), dt, rng)

    def evaluate(self, belief: Root, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each detection and track, linearised at the track's mean."""
        return self._roots.evaluate(belief, sensor, observed, p_gate)

    def update(self, belief: Root, innovation: Innovation, weights: Array) -> Root:
        """Return the moments of the weighted hypotheses."""
        return self._roots.update(belief, innovation, weights)

    def moments(self, belief: Root) -> Gaussian:
        return self._roots.moments(belief)

    def cross_covariance(self, belief: Root, dt: float) -> Array:
        """Return P F' L^(-T / step) (*b, t, n, n)."""
        return self._roots.cross_covariance(self._faded(belief, dt), dt)

    def _faded(self, belief: Root, dt: float) -> Root:
        """Return the belief with L^(-T / step) P."""
        if self.forgetting == 1.0:
            return belief
        grown = fading(np.sum(belief.root**2, axis=-1), -dt / self.step * math.log(self.forgetting))
        return Root(belief.mean, np.sqrt(grown)[..., None, None] * belief.root)
