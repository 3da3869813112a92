"""The bootstrap particle filter."""

from __future__ import annotations

import math
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
    Space,
    Traits,
    fields,
    filters,
    kernels,
)
from vedette.filters import OverMotion
from vedette_standard import particles
from vedette_standard.particles import Particles


@final
@frozen
class BootstrapParticles(OverMotion[Particles]):
    """Weighted points that move by the motion model with random noise, and are reweighted by their likelihood.

    w_p <- w_p sum_i W_i l_i(x_p) / l_i over association hypotheses i, the miss included, l_i = sum_p w_p l_i(x_p). Before a
    prediction, tracks whose effective number of points is low are resampled. A new track's points have exactly its prior's
    moments. Errors fall as 1/sqrt(particles); where the sensor is much more precise than the prediction few points remain,
    and 'auxiliary_particles' does better.
    Gordon, Salmond, Smith, Novel Approach to Nonlinear/Non-Gaussian Bayesian State Estimation, IEE Proc. F 140, 1993.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import LinearSensor, RandomWalk
    >>> rng, prior = np.random.default_rng(1), Gaussian(np.array([[100.0]]), np.array([[[9.0]]]))
    >>> estimator = BootstrapParticles(RandomWalk(2.0, axes=("x",)), particles=400, resample=0.5)
    >>> belief = estimator.start(prior, estimator.state, rng)
    >>> np.allclose(estimator.moments(belief).mean, 100.0), np.allclose(estimator.moments(belief).cov, 9.0)
    (True, True)
    >>> seen = estimator.evaluate(belief, LinearSensor(("x",), [[1.0]], [[1.0]], (), 0.8), Detections.of([[106.0]]), 0.9)
    >>> x = belief.points[0, :, 0]
    >>> likely = 0.8 * np.exp(-0.5 * (106.0 - x) ** 2) / np.sqrt(2.0 * np.pi)
    >>> np.allclose(seen.loglik[0], np.log([0.28, np.mean(likely)]))
    True
    >>> after = estimator.update(belief, seen, np.array([[0.01, 0.99]]))
    >>> w = (0.01 + 0.99 * likely / np.mean(likely)) / 400.0
    >>> np.allclose(np.exp(after.log_weights[0]), w), bool(1.0 / np.sum(w**2) < 200.0)
    (True, True)
    >>> ahead = estimator.predict(after, 0.25, rng)  # resampled, and spread by a variance of 4 / 4
    >>> m, P = w @ x, w @ x**2 - (w @ x) ** 2 + 1.0
    >>> np.allclose(ahead.log_weights, -np.log(400.0)), bool(abs(np.mean(ahead.points) - m) < 4.0 * np.sqrt(P / 400.0))
    (True, True)
    >>> kept = BootstrapParticles(RandomWalk(2.0, axes=("x",)), particles=400, resample=0.05).predict(after, 0.25, rng)
    >>> np.allclose(kept.log_weights, after.log_weights), bool(0.8 < np.std(kept.points - after.points) < 1.2)
    (True, True)
    """

    kind: ClassVar[str] = "bootstrap_particles"
    abbreviations: ClassVar[tuple[str, ...]] = ("pf",)
    declares: ClassVar[Traits] = Traits(draws=True)

    motion: MotionModel = fields.part("how the target moves")
    particles: int = fields.integer("points per track", default=1000, at_least=100, at_most=10**6)
    resample: float = fields.probability("share of effective points below which a track is resampled", default=0.5)

    def __attrs_post_init__(self) -> None:
        particles.check_particle_motion(self.motion)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Particles:
        """Return points drawn from the prior, of equal weight."""
        marginal = filters.marginal(prior, axes, self.state, self.zero_variance)
        return particles.draw_particles(marginal, self.particles, self.state, rng)

    def predict(self, belief: Particles, dt: float, rng: np.random.Generator) -> Particles:
        """Return the points `dt` s later, each with its own noise; resampled first if necessary."""
        if dt == 0:
            return belief
        points, offset = belief.points, rng.random(belief.log_weights.shape[:-1])
        due = particles.too_few(belief.log_weights, self.resample)[..., None]
        if due.any():
            points = np.where(
                due[..., None], particles.points_at(points, particles.resample(belief.log_weights, offset)), points
            )
        root, drawn = kernels.root(self.motion.noise(points, dt)), rng.standard_normal((*points.shape, 1))
        noise = drawn[..., 0] @ root.T if root.ndim == 2 else (root @ drawn)[..., 0]
        moved = self.state.displace(self.motion.move(points, dt), noise)
        return Particles(moved, np.where(due, -math.log(self.particles), belief.log_weights))

    def evaluate(self, belief: Particles, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the likelihood of each detection at each point of each track."""
        assert isinstance(observed, Detections)
        return particles.evaluate_particles(belief, self.state, sensor, observed, p_gate)

    def update(self, belief: Particles, innovation: Innovation, weights: Array) -> Particles:
        """Return the same points, reweighted."""
        log_weights = kernels.reweigh_particles(belief.log_weights, innovation.detail, innovation.loglik, weights)
        return Particles(belief.points, log_weights)

    def moments(self, belief: Particles) -> Gaussian:
        """Return mean and covariance of the points."""
        return particles.particle_moments(belief, self.state, self.zero_variance)
