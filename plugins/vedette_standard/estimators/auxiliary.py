"""The auxiliary particle filter."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

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
from vedette.tracking import Common
from vedette_standard import particles
from vedette_standard.particles import Particles


@frozen(eq=False)
class Predicted:
    """Predicted points, and all that is needed to predict them again from other ancestors once a scan has arrived.

    points (*b, t, p, n), log_weights (*b, t, p); of every ancestor its noise-free prediction, the centre (*b, t, p, n),
    and the root of its noise (*b, t, p, n, n); standard noise (*b, t, p, n) and an offset (*b, t), drawn beforehand.
    """

    points: Array
    log_weights: Array
    centres: Array
    roots: Array
    standard: Array
    offset: Array


@frozen(eq=False)
class PointHypotheses:
    """The scan: sensor, detections, P_G; its log likelihoods (*b, t, 1+k, p) at the points and, if any, at the centres."""

    scan: Common
    at_points: Array
    at_centres: Array | None


@final
@frozen
class AuxiliaryParticles(OverMotion[Particles | Predicted]):
    """A particle filter that looks at the scan before it chooses which points to propagate.

    With m_p the noise-free prediction of point p and g(x) the likelihood of the scan at x: ancestors are drawn with
    w_p g(m_p), their offspring x get weight g(x) / g(m_p). It does so where the likelihood leaves few effective points;
    elsewhere, as on an uninformative scan, it reweights like the bootstrap filter. The draws of the second move are made
    with the first.
    Pitt, Shephard, Filtering via Simulation: Auxiliary Particle Filters, J. American Statistical Association 94, 1999.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import LinearSensor, RandomWalk
    >>> rng, prior = np.random.default_rng(1), Gaussian(np.array([[100.0]]), np.array([[[9.0]]]))
    >>> estimator = AuxiliaryParticles(RandomWalk(2.0, axes=("x",)), particles=4000, resample=0.5)
    >>> belief = estimator.start(prior, estimator.state, rng)
    >>> np.allclose(estimator.moments(belief).mean, 100.0), np.allclose(estimator.moments(belief).cov, 9.0)
    (True, True)
    >>> ahead = estimator.predict(belief, 4.0, rng)  # variance 9 + 16
    >>> for R, far in (4.0, 5.0), (100.0, 20.0):  # sharper than the prediction, and less
    ...     seen = estimator.evaluate(ahead, LinearSensor(("x",), [[R]]), Detections.of([[100.0 + far]]), 1.0)
    ...     after, P = estimator.moments(estimator.update(ahead, seen, np.array([[0.0, 1.0]]))), 25.0 * R / (25.0 + R)
    ...     off = (after.mean.item() - 100.0 - P / R * far) / np.sqrt(P)
    ...     print(abs(off) < 0.25, 0.7 < after.cov.item() / P < 1.4)
    True True
    True True
    """

    kind: ClassVar[str] = "auxiliary_particles"
    declares: ClassVar[Traits] = Traits(draws=True)

    motion: MotionModel = fields.part("how the target moves")
    particles: int = fields.integer("points per track", default=1000, at_least=100, at_most=10**6)
    resample: float = fields.probability("share of effective points below which ancestors are chosen", default=0.5)

    def __attrs_post_init__(self) -> None:
        particles.check_particle_motion(self.motion)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Particles:
        """Return points drawn from the prior, of equal weight."""
        marginal = filters.marginal(prior, axes, self.state, self.zero_variance)
        return particles.draw_particles(marginal, self.particles, self.state, rng)

    def predict(self, belief: Particles | Predicted, dt: float, rng: np.random.Generator) -> Particles | Predicted:
        """Return the points `dt` s later, with the centres needed to choose ancestors."""
        if dt == 0:
            return belief
        offsets = rng.random((2, *belief.log_weights.shape[:-1]))
        due = particles.too_few(belief.log_weights, self.resample)[..., None]
        points = particles.points_at(belief.points, particles.resample(belief.log_weights, offsets[0]))
        points = np.where(due[..., None], points, belief.points)
        centres = self.motion.move(points, dt)
        roots = np.broadcast_to(kernels.root(self.motion.noise(points, dt)), (*points.shape, points.shape[-1]))
        standard = rng.standard_normal(points.shape)
        moved = self._scattered(centres, roots, standard)
        log_weights = np.where(due, -math.log(self.particles), belief.log_weights)
        return Predicted(moved, log_weights, centres, roots, standard, offsets[1])

    def _scattered(self, centres: Array, roots: Array, standard: Array) -> Array:
        return self.state.displace(centres, (roots @ standard[..., None])[..., 0])

    def evaluate(
        self, belief: Particles | Predicted, sensor: Sensor, observed: Detections | Frame, p_gate: float
    ) -> Innovation:
        """Return the likelihood of each detection at each point and each centre of each track."""
        assert isinstance(observed, Detections)
        scan, at_centres = (sensor, observed, p_gate), None
        found = self._evaluated(belief.points, belief.log_weights, *scan)
        if isinstance(belief, Predicted):
            at_centres = self._evaluated(belief.centres, belief.log_weights, *scan).detail
        return evolve(found, detail=PointHypotheses(Common(scan), found.detail, at_centres))

    def _evaluated(
        self, points: Array, log_weights: Array, sensor: Sensor, detections: Detections, p_gate: float
    ) -> Innovation:
        return particles.evaluate_particles(Particles(points, log_weights), self.state, sensor, detections, p_gate)

    def update(self, belief: Particles | Predicted, innovation: Innovation, weights: Array) -> Particles:
        """Return points from ancestors that the scan favours, where it is informative; else the same points, reweighted."""
        detail: PointHypotheses = innovation.detail
        seen = (innovation.loglik, weights)
        log_weights = kernels.reweigh_particles(belief.log_weights, detail.at_points, *seen)
        if not isinstance(belief, Predicted) or detail.at_centres is None:
            return Particles(belief.points, log_weights)
        foreseen = kernels.reweigh_particles(np.zeros(log_weights.shape), detail.at_centres, *seen)
        news = particles.too_few(foreseen, self.resample)[..., None]
        if not news.any():
            return Particles(belief.points, log_weights)
        index = particles.resample(particles.normalised(belief.log_weights + foreseen), belief.offset)
        roots = np.take_along_axis(belief.roots, index[..., None, None], axis=-3)
        points = self._scattered(particles.points_at(belief.centres, index), roots, belief.standard)
        before = -np.take_along_axis(foreseen, index, axis=-1)
        again = self._evaluated(points, log_weights, *detail.scan.value).detail
        points = np.where(news[..., None], points, belief.points)
        return Particles(points, np.where(news, kernels.reweigh_particles(before, again, *seen), log_weights))

    def moments(self, belief: Particles | Predicted) -> Gaussian:
        """Return mean and covariance of the points."""
        points = Particles(belief.points, belief.log_weights)
        return particles.particle_moments(points, self.state, self.zero_variance)
