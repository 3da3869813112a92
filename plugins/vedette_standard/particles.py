"""What particle filters share: weighted points, their moments, resampling, and likelihoods at points."""

from __future__ import annotations

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, Detections, Gaussian, Innovation, Mask, MotionModel, Sensor, Space, kernels
from vedette.filters import as_slice, own_twin, prepare, without_variance

_LEAST = -230.0
"""Logarithm of the least weight that counts, 1e-100."""


@frozen(eq=False)
class Particles:
    """Points (*b, t, p, n) and the logarithms of their weights (*b, t, p), which sum to 1."""

    points: Array
    log_weights: Array


def check_particle_motion(motion: MotionModel) -> None:
    """Raise ValueError for a model that reframes beliefs: it does so for Gaussians only."""
    if motion.reframes:
        raise ValueError(f"motion: {motion.kind!r} turns its frame with its target, which particles cannot follow")


def draw_particles(prior: Gaussian, count: int, state: Space, rng: np.random.Generator) -> Particles:
    """Return points of equal weight with exactly the prior's mean and covariance: draws, whitened by their own moments."""
    standard = rng.standard_normal((*prior.mean.shape[:-1], count, prior.mean.shape[-1]))
    standard -= np.mean(standard, axis=-2, keepdims=True)
    spread = np.swapaxes(standard, -1, -2) @ standard / count
    white = standard @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(spread)), -1, -2)
    points = state.canonical(prior.mean[..., None, :] + white @ np.swapaxes(kernels.root(prior.cov), -1, -2))
    return Particles(points, np.full(points.shape[:-1], -math.log(count)))


def point_weights(log_weights: Array) -> Array:
    """Return weights (*b, t, p), 0 where one is so small that a square times it would be no number of full precision."""
    return np.exp(np.where(log_weights < _LEAST, -np.inf, log_weights))


def particle_moments(particles: Particles, state: Space, zero_variance: Space) -> Gaussian:
    """Return mean (*b, t, n) and covariance (*b, t, n, n) over `state`; the axes `zero_variance` have no variance."""
    weights = point_weights(particles.log_weights)
    mean, apart = state.mean(particles.points, weights)
    cov = kernels.symmetric(np.swapaxes(apart * weights[..., None], -1, -2) @ apart)
    return Gaussian(mean, without_variance(cov, state.locate(zero_variance)) if len(zero_variance) else cov)


def too_few(log_weights: Array, least: float) -> Mask:
    """Return where the effective number of points, 1 / sum w^2, is below the share `least` of all: (*b, t, p) -> (*b, t)"""
    return np.sum(point_weights(2 * log_weights), axis=-1) * least * log_weights.shape[-1] > 1.0


def resample(log_weights: Array, offset: Array) -> NDArray[np.intp]:
    """Return which points (*b, t, p) systematic resampling takes; `offset` (*b, t) is uniform in [0, 1).

    Kitagawa, Monte Carlo Filter and Smoother for Non-Gaussian Nonlinear State Space Models, JCGS 5, 1996.
    """
    p = log_weights.shape[-1]
    rows = log_weights.reshape(-1, p)
    levels = np.cumsum(point_weights(rows), axis=-1)
    levels /= levels[:, -1:]
    below = np.ceil(levels * p - offset.reshape(-1, 1)).astype(np.intp)  # of the marks (0 + u) / p, (1 + u) / p, ...
    below[:, -1] = p
    times = np.diff(below, axis=-1, prepend=0)
    return np.repeat(np.broadcast_to(np.arange(p), rows.shape).ravel(), times.ravel()).reshape(log_weights.shape)


def points_at(points: Array, index: NDArray[np.intp]) -> Array:
    """Return the `points` (*b, t, p, n) of `index` (*b, t, p)."""
    return np.take_along_axis(points, index[..., None], axis=-2)


def _seen(points: Array, state: Space, sensor: Sensor) -> tuple[Array, Array, Array]:
    """Return what a sensor says of points (*b, t, p, n): z (.., m), R (.., m, m) or (m, m), P_D (..) or ()."""
    x, twin = points[..., as_slice(state.locate(sensor.observes))], own_twin(sensor)
    if twin is not None:
        measured = kernels.measure_twin(x, twin.function, twin.numbers(x), len(sensor.measurement))
        if measured is not None:
            return measured.z, measured.noise, measured.detects
    return sensor.measure(x), sensor.noise(x), np.asarray(sensor.detects(x))


def evaluate_particles(
    particles: Particles, state: Space, sensor: Sensor, detections: Detections, p_gate: float
) -> Innovation:
    """Return the innovation of points: distances by the moments of what they expect, log likelihoods averaged over them.

    Its detail is the log likelihoods (*b, t, 1+k, p) of a miss and of every detection at every point.
    """
    z, R, p_detect = _seen(particles.points, state, sensor)
    if detections.missing is None and detections.noise is None:
        own, detects = (R if R.ndim > 2 else R[None]), (p_detect if p_detect.ndim else p_detect[None])
        periods = sensor.measurement.periods
        found = kernels.evaluate_particles(particles.log_weights, detections.z, z, own, detects, p_gate, periods)
        if found is not None:
            H, noise = np.eye(z.shape[-1]), found.noise[..., None, :, :]
            by = kernels.evaluate_returns(found.cov, detections.z, found.mean, H, noise, 1.0, p_gate, periods)
            return Innovation(found.loglik, by.distance, by.log_volume, by.distance, found.likelihoods)
    weights = point_weights(particles.log_weights)
    likelihoods = _likelihoods(z, R, p_detect, sensor, detections, p_gate)
    expected, dz = sensor.measurement.mean(z, weights)
    if R.ndim > 2:
        R = np.sum(weights[..., None, None] * R, axis=-3)
    ready = prepare(sensor, detections, expected, R)
    rows = (dz * np.sqrt(weights)[..., None])[..., None, :, :]
    inverse, log_det, _ = kernels.gains_of_points(rows[..., :0], ready.columns(rows), ready.noise)
    distance = np.sum(ready.residuals * (inverse @ ready.residuals[..., None])[..., 0], axis=-1)
    loglik = kernels.log_sum(likelihoods + particles.log_weights[..., None, :])
    volume = np.broadcast_to(np.max(0.5 * log_det, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(loglik, distance, volume, distance, likelihoods)


def _likelihoods(z: Array, R: Array, p_detect: Array, sensor: Sensor, detections: Detections, p_gate: float) -> Array:
    ready = prepare(sensor, detections, z, R, points=True)
    nu, root = ready.residuals, np.linalg.cholesky(ready.noise)
    over = np.swapaxes(np.linalg.inv(root), -1, -2)
    if over.ndim == 2 or over.shape[-3] == 1:  # one noise for all points: one product
        white = nu @ (over if over.ndim == 2 else over[..., 0, :, :])
    else:
        white = (nu[..., None, :] @ over)[..., 0, :]
    log_det = np.sum(np.log(np.diagonal(root, axis1=-2, axis2=-1)), axis=-1)
    m = nu.shape[-1]
    loglik = -0.5 * np.sum(white**2, axis=-1) - log_det - 0.5 * m * math.log(2 * math.pi) + ready.log_constant
    p_detect = np.broadcast_to(p_detect, z.shape[:-1])
    columns = np.empty((*z.shape[:-2], 1 + nu.shape[-3], z.shape[-2]))
    columns[..., 0, :] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:, :] = loglik + kernels.safe_log(p_detect)[..., None, :]
    return columns


def normalised(log_weights: Array) -> Array:
    """Return log weights (*b, t, p) that sum to 1."""
    return log_weights - kernels.log_sum(log_weights)[..., None]
