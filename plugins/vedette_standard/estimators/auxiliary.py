"""The auxiliary particle filter."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, Detections, Estimator, Frame, Gaussian, Innovation, MotionModel, Sensor, Space, fields
from vedette.sampling.trajectories import factor
from vedette_standard.estimators import cloud as clouds
from vedette_standard.estimators.bootstrap import BootstrapParticles
from vedette_standard.estimators.cloud import Cloud


@frozen(eq=False)
class Ahead:
    """A predicted cloud, and all that is needed to predict it anew from other ancestors once a scan is in.

    points (*b, t, p, n), log_weights (*b, t, p); of every ancestor its centre (*b, t, p, n), where it moves without noise,
    and the root of its noise (*b, t, p, n, n); standard noise (*b, t, p, n) and an offset (*b, t), drawn beforehand.
    """

    points: Array
    log_weights: Array
    centres: Array
    roots: Array
    standard: Array
    offset: Array


@frozen(eq=False)
class Look:
    """The scan, and its log likelihoods (*b, t, 1+k, p) at the points and, if there are any, at the centres."""

    sensor: Sensor
    seen: Detections
    p_gate: float
    at_points: Array
    at_centres: Array | None


@final
@frozen
class AuxiliaryParticles(Estimator[Cloud | Ahead]):
    """A particle filter that looks at the scan before it chooses which points to move on.

    With m_p where point p moves without noise and g(x) what association makes of the scan at x: ancestors are drawn with
    w_p g(m_p), their offspring x weigh g(x) / g(m_p). It chooses so where the look leaves few effective points, and weighs
    anew like the bootstrap filter elsewhere, as on a scan without news. The draws of the second move are made at the first.
    Pitt, Shephard, Filtering via Simulation: Auxiliary Particle Filters, J. American Statistical Association 94, 1999.
    """

    kind: ClassVar[str] = "auxiliary_particles"

    motion: MotionModel = fields.part("how the target moves")
    particles: int = fields.integer("points per track", default=1000, at_least=100, at_most=10**6)
    resample: float = fields.probability("share of effective points below which ancestors are chosen", default=0.5)
    _plain: BootstrapParticles = field(init=False, repr=False, eq=False)

    @_plain.default
    def _bootstrap(self) -> BootstrapParticles:
        return BootstrapParticles(self.motion, self.particles, self.resample)

    state: Space = field(init=False, repr=False, eq=False, default=Factory(lambda self: self.motion.state, takes_self=True))

    @property
    def zero_variance(self) -> Space:
        return self.motion.zero_variance

    def refuses(self, sensor: Sensor) -> str | None:
        """Cameras."""
        return self._plain.refuses(sensor)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Cloud:
        """Points drawn from the prior, of equal weight."""
        return self._plain.start(prior, axes, rng)

    def predict(
        self, belief: Cloud | Ahead, dt: float, rng: np.random.Generator, combined: Gaussian | None = None
    ) -> Cloud | Ahead:
        """The points `dt` s later, with the means to choose again."""
        if dt == 0:
            return belief
        offsets = rng.random((2, *belief.log_weights.shape[:-1]))
        due = clouds.too_few(belief.log_weights, self.resample)[..., None]
        points = clouds.taken(belief.points, clouds.chosen(belief.log_weights, offsets[0]))
        points = np.where(due[..., None], points, belief.points)
        centres = self.motion.move(points, dt)
        roots = np.broadcast_to(factor(self.motion.noise(points, dt)), (*points.shape, points.shape[-1]))
        standard = rng.standard_normal(points.shape)
        moved = self._scattered(centres, roots, standard)
        log_weights = np.where(due, -math.log(self.particles), belief.log_weights)
        return Ahead(moved, log_weights, centres, roots, standard, offsets[1])

    def _scattered(self, centres: Array, roots: Array, standard: Array) -> Array:
        return self.state.displace(centres, (roots @ standard[..., None])[..., 0])

    def evaluate(self, belief: Cloud | Ahead, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Every return against every point and every centre of every track."""
        assert isinstance(observed, Detections)
        columns = clouds.likelihoods(belief.points, self.state, sensor, observed, p_gate)
        centres = None
        if isinstance(belief, Ahead):
            centres = clouds.likelihoods(belief.centres, self.state, sensor, observed, p_gate)
        cloud = Cloud(belief.points, belief.log_weights)
        return clouds.innovation(
            cloud, columns, self.state, sensor, observed, Look(sensor, observed, p_gate, columns, centres)
        )

    def update(self, belief: Cloud | Ahead, innovation: Innovation, weights: Array) -> Cloud:
        """Points from ancestors that the scan speaks for, where it speaks; else the same, weighed anew."""
        look: Look = innovation.detail
        told = clouds.claim(look.at_points, innovation.loglik, weights)
        log_weights = clouds.normal(belief.log_weights + told)
        if not isinstance(belief, Ahead) or look.at_centres is None:
            return Cloud(belief.points, log_weights)
        ahead = clouds.claim(look.at_centres, innovation.loglik, weights)
        first = clouds.normal(belief.log_weights + ahead)
        news = clouds.too_few(clouds.normal(ahead), self.resample)[..., None]
        if not news.any():
            return Cloud(belief.points, log_weights)
        index = clouds.chosen(first, belief.offset)
        roots = np.take_along_axis(belief.roots, index[..., None, None], axis=-3)
        points = self._scattered(clouds.taken(belief.centres, index), roots, belief.standard)
        again = clouds.likelihoods(points, self.state, look.sensor, look.seen, look.p_gate)
        second = clouds.claim(again, innovation.loglik, weights) - np.take_along_axis(ahead, index, axis=-1)
        return Cloud(np.where(news[..., None], points, belief.points), np.where(news, clouds.normal(second), log_weights))

    def moments(self, belief: Cloud | Ahead) -> Gaussian:
        """Mean and covariance of the points."""
        return clouds.moments(Cloud(belief.points, belief.log_weights), self.state, self.zero_variance)
