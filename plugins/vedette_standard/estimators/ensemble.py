"""The ensemble Kalman filter."""

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
    Indices,
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


@frozen(eq=False)
class Ensemble:
    """Equally likely states (*b, t, p, n), and what the draws of the next update are seeded with (*b, t)."""

    points: Array
    key: Indices


@frozen(eq=False)
class Pulls:
    """What pulls the points for each return: the residual of their mean (*b, t, k, m), how far each one's own measurement
    lies from the mean's (*b, t, 1|k, p, m), the gain (*b, t, 1|k, n, m), and a root of the noise (*b, t, 1|k, m, m).
    """

    residuals: Array
    apart: Array
    gain: Array
    root: Array


@final
@frozen
class EnsembleKalman(OverMotion[Ensemble]):
    """Equally likely states that move with drawn noise; a return, perturbed anew for each, pulls them by one gain.

    x_p+ = x_p + K (z + e_p - h(x_p)), e_p ~ N(0, R), K = C (D + R)^-1, with C the covariance of the points and their
    measurements, D that of these. Under soft association each point takes one return or the miss, by their weights.
    Errors fall as 1 / sqrt(members). A new track's points have exactly its prior's moments.
    Burgers, van Leeuwen, Evensen, Analysis Scheme in the Ensemble Kalman Filter, Monthly Weather Review 126, 1998.

    >>> from vedette import Detections, Gaussian
    >>> from vedette_standard import LinearSensor, RandomWalk
    >>> rng, prior = np.random.default_rng(1), Gaussian(np.array([[100.0]]), np.array([[[9.0]]]))
    >>> estimator = EnsembleKalman(RandomWalk(2.0, axes=("x",)), members=2000)
    >>> belief = estimator.start(prior, estimator.state, rng)
    >>> np.allclose(estimator.moments(belief).mean, 100.0), np.allclose(estimator.moments(belief).cov, 9.0)
    (True, True)
    >>> ahead = estimator.predict(belief, 4.0, rng)
    >>> m, D = np.mean(ahead.points), np.var(ahead.points, ddof=1)  # about 100 and 9 + 16
    >>> bool(abs(D - 25.0) < 4.0 * 25.0 * np.sqrt(2.0 / 2000.0)), np.allclose(estimator.cross_covariance(ahead, 1.0), D)
    (True, True)
    >>> seen = estimator.evaluate(ahead, LinearSensor(("x",), [[9.0]], [[1.0]], (), 0.8), Detections.of([[110.0]]), 0.9)
    >>> S, K, nu = D + 9.0, D / (D + 9.0), 110.0 - m
    >>> np.allclose(seen.loglik[0], [np.log(0.28), np.log(0.8) - 0.5 * (nu**2 / S + np.log(2.0 * np.pi * S))])
    True
    >>> after = estimator.moments(estimator.update(ahead, seen, np.array([[0.0, 1.0]])))
    >>> bool(abs(after.mean.item() - m - K * nu) < 4.0 * np.sqrt(K * K * 9.0 / 2000.0))
    True
    >>> bool(0.87 < after.cov.item() / (K * 9.0) < 1.13)
    True
    >>> half = estimator.update(ahead, seen, np.array([[0.25, 0.75]])).points
    >>> int(np.sum(half == ahead.points))  # a quarter of the points take the miss
    500
    """

    kind: ClassVar[str] = "ensemble_kalman"
    abbreviations: ClassVar[tuple[str, ...]] = ("enkf",)
    declares: ClassVar[Traits] = Traits(draws=True)

    motion: MotionModel = fields.part("how the target moves")
    members: int = fields.integer("states per track", default=400, at_least=20, at_most=10**6)

    def __attrs_post_init__(self) -> None:
        particles.check_particle_motion(self.motion)

    def start(self, prior: Gaussian, axes: Space, rng: np.random.Generator) -> Ensemble:
        """Return points drawn from the prior."""
        marginal = filters.marginal(prior, axes, self.state, self.zero_variance)
        shrunk = Gaussian(marginal.mean, marginal.cov * (1 - 1 / self.members))  # of which `moments` makes the prior's
        points = particles.draw_particles(shrunk, self.members, self.state, rng).points
        return Ensemble(points, _key(points, rng))

    def predict(self, belief: Ensemble, dt: float, rng: np.random.Generator) -> Ensemble:
        """Return the points `dt` s later, each with its own noise."""
        if dt == 0:
            return belief
        points = belief.points
        noise = kernels.root(self.motion.noise(points, dt)) @ rng.standard_normal((*points.shape, 1))
        moved = self.state.displace(self.motion.move(points, dt), noise[..., 0])
        return Ensemble(moved, _key(moved, rng))

    def evaluate(self, belief: Ensemble, sensor: Sensor, observed: Detections | Frame, p_gate: float) -> Innovation:
        """Return the innovation of each detection and track, by the moments of the points' measurements."""
        assert isinstance(observed, Detections)
        where = self.state.locate(sensor.observes)
        mean, dx = self._moments(belief.points, self.state)
        expected, dz = self._moments(sensor.measure(belief.points[..., where]), sensor.measurement)
        x = mean[..., where]
        ready = filters.prepare(sensor, observed, expected, sensor.noise(x))
        dz, R, share = ready.columns(dz[..., None, :, :]), ready.noise, 1 / math.sqrt(self.members - 1)
        inverse, log_det, gain = kernels.gains_of_points(share * dx[..., None, :, :], share * dz, R)
        distance = np.sum(ready.residuals * (inverse @ ready.residuals[..., None])[..., 0], axis=-1)
        log_volume = 0.5 * log_det
        loglik = -0.5 * (distance + R.shape[-1] * math.log(2 * math.pi)) - log_volume + ready.log_constant
        root = ready.columns(np.swapaxes(np.linalg.cholesky(R), -1, -2))  # what is missing is not perturbed
        root = np.broadcast_to(np.swapaxes(root, -1, -2), (*x.shape[:-1], *root.shape[-3:]))
        detail = Pulls(ready.residuals, dz, gain, root)
        return filters.make_innovation(sensor, x, p_gate, loglik, distance, log_volume, detail)

    def update(self, belief: Ensemble, innovation: Innovation, weights: Array) -> Ensemble:
        """Return the points, each pulled by one return or left as by a miss."""
        found: Pulls = innovation.detail
        points, (p, m) = belief.points, found.apart.shape[-2:]
        rng = np.random.default_rng([int(key) for key in belief.key.flat])
        place = rng.permuted(np.broadcast_to(np.arange(p), points.shape[:-1]), axis=-1)
        mark = (place + rng.random((*points.shape[:-2], 1))) / p
        order = np.argsort(innovation.distance, axis=-1)  # so that the order of the returns is free
        sorted_weights = np.take_along_axis(weights[..., 1:], order, axis=-1)
        levels = np.cumsum(np.concatenate([weights[..., :1], sorted_weights], axis=-1), axis=-1)
        after = mark[..., None, :] * levels[..., -1:, None] >= levels[..., :-1, None]  # (*b, t, k, p)
        taken = after & ~np.concatenate([after[..., 1:, :], np.zeros_like(after[..., :1, :])], axis=-2)
        chosen = np.take_along_axis(taken, np.argsort(order, axis=-1)[..., None], axis=-2)
        perturbed = rng.standard_normal((*points.shape[:-2], 1, p, m)) @ np.swapaxes(found.root, -1, -2)
        pulls = (found.residuals[..., None, :] - found.apart + perturbed) @ np.swapaxes(found.gain, -1, -2)
        shift = np.sum(np.where(chosen[..., None], pulls, 0.0), axis=-3)
        return Ensemble(self.state.displace(points, shift), _key(points, rng))

    def moments(self, belief: Ensemble) -> Gaussian:
        """Return mean and covariance of the points."""
        mean, dx = self._moments(belief.points, self.state)
        cov = kernels.symmetric(np.swapaxes(dx, -1, -2) @ dx / (self.members - 1))
        if len(self.zero_variance):
            cov = filters.without_variance(cov, self.state.locate(self.zero_variance))
        return Gaussian(mean, cov)

    def cross_covariance(self, belief: Ensemble, dt: float) -> Array:
        """Return the covariance (*b, t, n, n) between the points and where they move."""
        _, now = self._moments(belief.points, self.state)
        _, then = self._moments(self.motion.move(belief.points, dt), self.state)
        return np.swapaxes(now, -1, -2) @ then / (self.members - 1)

    def ahead(self, belief: Ensemble, dt: float, rng: np.random.Generator) -> Gaussian:
        """Return the moments of the points where they move, the mean of their noise added: as it is, not as it is drawn."""
        points = belief.points
        moved = self.moments(Ensemble(self.motion.move(points, dt), belief.key))
        noise = np.broadcast_to(self.motion.noise(points, dt), (*points.shape, points.shape[-1]))
        return Gaussian(moved.mean, moved.cov + np.mean(noise, axis=-3))

    def _moments(self, points: Array, space: Space) -> tuple[Array, Array]:
        """Return the mean (*b, t, n) of points (*b, t, p, n) and how far each is from it."""
        return space.mean(points, np.full(points.shape[:-1], 1 / points.shape[-2]))


def _key(points: Array, rng: np.random.Generator) -> Indices:
    """Return a number for each track, drawn."""
    return rng.integers(2**62, size=points.shape[:-2])
