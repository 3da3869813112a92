"""The auxiliary particle filter."""

from __future__ import annotations

import math
from typing import Any, ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import (
    Array,
    Detections,
    Frame,
    Gaussian,
    Innovation,
    Mask,
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
class Ahead:
    """What predicts points again from other ancestors once a scan has arrived.

    Of every ancestor its noise-free prediction, the centre (*b, t, p, n), and the root of its noise (*b, t, p, n, n), or
    (*b, t, 1, n, n) if all points of a track have one; standard noise (*b, t, p, n) and an offset (*b, t), drawn beforehand.
    """

    centres: Array
    roots: Array
    standard: Array
    offset: Array


@frozen(eq=False)
class Looking:
    """Points, and how they came about; None since a scan, and where some tracks were not predicted as the others were."""

    now: Particles
    ahead: Ahead | None


@frozen(eq=False)
class PointHypotheses:
    """The scan: sensor and P_G; for each track its returns, their noises and what they lack; its log likelihoods
    (*b, t, 1+k, p) at the points and, if any, at the centres.
    """

    scan: Common
    z: Array
    noise: Array | None
    missing: Mask | None
    at_points: Array
    at_centres: Array | None


@final
@frozen
class AuxiliaryParticles(OverMotion[Looking]):
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

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Looking:
        """Return points drawn from the prior, of equal weight."""
        marginal = filters.marginal(prior, axes, self.state, self.zero_variance)
        return Looking(particles.draw_particles(marginal, self.particles, self.state, rng), None)

    def predict(self, belief: Looking, dt: float, rng: np.random.Generator) -> Looking:
        """Return the points `dt` s later, with the centres needed to choose ancestors."""
        if dt == 0:
            return belief
        before, log_weights = belief.now.points, belief.now.log_weights
        offsets = rng.random((2, *log_weights.shape[:-1]))
        due = particles.too_few(log_weights, self.resample)[..., None]
        points = particles.points_at(before, particles.resample(log_weights, offsets[0]))
        points = np.where(due[..., None], points, before)
        centres = self.motion.move(points, dt)
        roots, (*tracks, _, n) = kernels.root(self.motion.noise(points, dt)), points.shape
        roots = np.broadcast_to(roots, (*tracks, 1 if roots.ndim == 2 else self.particles, n, n))
        standard = rng.standard_normal(points.shape)
        moved = Particles(self._scattered(centres, roots, standard), np.where(due, -math.log(self.particles), log_weights))
        return Looking(moved, Ahead(centres, roots, standard, offsets[1]))

    def _scattered(self, centres: Array, roots: Array, standard: Array) -> Array:
        if roots.shape[-3] == 1:  # one product for all points of a track
            return self.state.displace(centres, standard @ np.swapaxes(roots[..., 0, :, :], -1, -2))
        return self.state.displace(centres, (roots @ standard[..., None])[..., 0])

    def evaluate(self, belief: Looking, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the likelihood of each detection at each point and each centre of each track."""
        assert isinstance(observed, Detections)
        scan, log_weights, at_centres = (self.state, sensor, observed, p_gate), belief.now.log_weights, None
        found = particles.evaluate_particles(belief.now, *scan)
        if belief.ahead is not None:
            at_centres = particles.evaluate_particles(Particles(belief.ahead.centres, log_weights), *scan).detail
        lead = log_weights.shape[:-1]
        z, missing = _for_each(lead, observed.z, 2), _for_each(lead, observed.missing, 2)
        noise = _for_each(lead, observed.noise, 3)
        return evolve(found, detail=PointHypotheses(Common((sensor, p_gate)), z, noise, missing, found.detail, at_centres))

    def update(self, belief: Looking, innovation: Innovation, weights: Array) -> Looking:
        """Return points from ancestors that the scan favours, where it is informative; else the same points, reweighted."""
        detail: PointHypotheses = innovation.detail
        seen, now, ahead = (innovation.loglik, weights), belief.now, belief.ahead
        log_weights = kernels.reweigh_particles(now.log_weights, detail.at_points, *seen)
        same = Looking(Particles(now.points, log_weights), None)
        if ahead is None or detail.at_centres is None:
            return same
        foreseen = kernels.reweigh_particles(np.zeros(log_weights.shape), detail.at_centres, *seen)
        news = particles.too_few(foreseen, self.resample)[..., None]
        if not news.any():
            return same
        index = particles.resample(particles.normalised(now.log_weights + foreseen), ahead.offset)
        roots = ahead.roots
        if roots.shape[-3] > 1:
            roots = np.take_along_axis(roots, index[..., None, None], axis=-3)
        points = self._scattered(particles.points_at(ahead.centres, index), roots, ahead.standard)
        before = -np.take_along_axis(foreseen, index, axis=-1)
        sensor, p_gate = detail.scan.value
        # Each track is a run of its own, as it may have met returns of its own.
        own = Detections(detail.z, np.ones(detail.z.shape[:-1], dtype=bool), None, detail.noise, detail.missing)
        one = Particles(points[..., None, :, :], log_weights[..., None, :])
        again = particles.evaluate_particles(one, self.state, sensor, own, p_gate).detail[..., 0, :, :]
        points = np.where(news[..., None], points, now.points)
        return Looking(Particles(points, np.where(news, kernels.reweigh_particles(before, again, *seen), log_weights)), None)

    def moments(self, belief: Looking) -> Gaussian:
        """Return mean and covariance of the points."""
        return particles.particle_moments(belief.now, self.state, self.zero_variance)


def _for_each(lead: tuple[int, ...], of: Any, axes: int) -> Any:
    """Return what a scan has of its returns, in so many last axes, for each track (*b, t); None if it has nothing."""
    return None if of is None else np.broadcast_to(np.expand_dims(of, -1 - axes), (*lead, *of.shape[-axes:]))
