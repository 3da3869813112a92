"""The bootstrap particle filter."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, fields
from vedette.filters.gaussian import own_part
from vedette.roles import ImagingSensor
from vedette.sampling.trajectories import factor
from vedette_standard.estimators import cloud as clouds
from vedette_standard.estimators.cloud import Cloud


@final
@frozen
class BootstrapParticles(Estimator[Cloud]):
    """Weighted points that move by the motion model with its noise drawn, and are weighed by what is seen.

    w_p <- w_p sum_i W_i l_i(x_p) / l_i over association hypotheses i, the miss included, l_i = sum_p w_p l_i(x_p). Before a
    prediction, tracks whose effective number of points is low are resampled. A new track's points have exactly its prior's
    moments. Errors fall as 1/sqrt(particles); where the sensor is much sharper than the prediction few points are left, and
    'auxiliary_particles' does better.
    Gordon, Salmond, Smith, Novel Approach to Nonlinear/Non-Gaussian Bayesian State Estimation, IEE Proc. F 140, 1993.
    """

    kind: ClassVar[str] = "bootstrap_particles"

    motion: MotionModel = fields.part("how the target moves")
    particles: int = fields.integer("points per track", default=1000, at_least=100, at_most=10**6)
    resample: float = fields.probability("share of effective points below which a track is resampled", default=0.5)

    def __attrs_post_init__(self) -> None:
        clouds.own_frame(self.motion)

    @property
    def state(self) -> Space:
        return self.motion.state

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def refuses(self, sensor: Sensor) -> str | None:
        """Cameras."""
        return "it works on returns, not on frames: use 'ekf' or 'iekf'" if isinstance(sensor, ImagingSensor) else None

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Cloud:
        """Points drawn from the prior, of equal weight."""
        own = own_part(prior, axes, self.state, self.zero_variance)
        points = self.state.canonical(clouds.scatter(own, self.particles, rng))
        return Cloud(points, np.full(points.shape[:-1], -math.log(self.particles)))

    def predict(self, belief: Cloud, dt: float, rng: np.random.Generator, combined: Gaussian | None = None) -> Cloud:
        """The points `dt` s later, each with its own noise; resampled first where that is due."""
        if dt == 0:
            return belief
        index = clouds.chosen(belief.log_weights, rng.random(belief.log_weights.shape[:-1]))
        due = clouds.too_few(belief.log_weights, self.resample)[..., None]
        points = np.where(due[..., None], clouds.taken(belief.points, index), belief.points)
        noise = factor(self.motion.noise(points, dt)) @ rng.standard_normal((*points.shape, 1))
        moved = self.state.displace(self.motion.move(points, dt), noise[..., 0])
        return Cloud(moved, np.where(due, -math.log(self.particles), belief.log_weights))

    def evaluate(self, belief: Cloud, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every point of every track."""
        assert isinstance(observed, Detections)
        columns = clouds.likelihoods(belief.points, self.state, sensor, observed, p_gate)
        return clouds.innovation(belief, columns, self.state, sensor, observed, columns)

    def update(self, belief: Cloud, innovation: Innovation, weights: Array) -> Cloud:
        """The same points, weighed anew."""
        told = clouds.claim(innovation.detail, innovation.loglik, weights)
        return Cloud(belief.points, clouds.normal(belief.log_weights + told))

    def moments(self, belief: Cloud) -> Gaussian:
        """Mean and covariance of the points."""
        return clouds.moments(belief, self.state, self.zero_variance)
