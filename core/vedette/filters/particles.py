"""The common part of particle filters: weighted points, their moments, resampling, and likelihoods at points."""

from __future__ import annotations

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import kernels
from vedette.filters.detections import prepare
from vedette.filters.gaussian import without_variance
from vedette.roles import MotionModel, Sensor
from vedette.space import Array, Mask, Space
from vedette.types import Detections, Gaussian, Innovation

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
    few: Mask = np.exp(kernels.log_sum(2 * log_weights)) * least * log_weights.shape[-1] > 1.0
    return few


def resample(log_weights: Array, offset: Array) -> NDArray[np.intp]:
    """Return which points (*b, t, p) systematic resampling takes; `offset` (*b, t) is uniform in [0, 1).

    Kitagawa, Monte Carlo Filter and Smoother for Non-Gaussian Nonlinear State Space Models, JCGS 5, 1996.
    """
    p = log_weights.shape[-1]
    rows = log_weights.reshape(-1, p)
    levels = np.cumsum(point_weights(rows), axis=-1)
    levels /= levels[:, -1:]
    marks = (np.arange(p) + offset.reshape(-1, 1)) / p
    # One sorted list for all rows: row i has the levels from i to i + 1.
    base = np.arange(len(rows))[:, None]
    index = np.searchsorted((levels + base).ravel(), (marks + base).ravel(), side="right").reshape(-1, p) - base * p
    inside: NDArray[np.intp] = np.clip(index, 0, p - 1).reshape(log_weights.shape)
    return inside


def points_at(points: Array, index: NDArray[np.intp]) -> Array:
    """Return the `points` (*b, t, p, n) of `index` (*b, t, p)."""
    return np.take_along_axis(points, index[..., None], axis=-2)


def point_likelihoods(points: Array, state: Space, sensor: Sensor, detections: Detections, p_gate: float) -> Array:
    """Return the log likelihood of a miss (column 0) and of every detection at every point: (*b, t, 1+k, p)."""
    x = points[..., state.locate(sensor.observes)]
    ready = prepare(sensor, detections, sensor.measure(x), sensor.noise(x), points=True)
    nu, root = ready.residuals, np.linalg.cholesky(ready.noise)
    over = np.swapaxes(np.linalg.inv(root), -1, -2)
    if over.ndim == 2 or over.shape[-3] == 1:  # one noise for all points: one product
        white = nu @ (over if over.ndim == 2 else over[..., 0, :, :])
    else:
        white = (nu[..., None, :] @ over)[..., 0, :]
    log_det = np.sum(np.log(np.diagonal(root, axis1=-2, axis2=-1)), axis=-1)
    m = nu.shape[-1]
    loglik = -0.5 * np.sum(white**2, axis=-1) - log_det - 0.5 * m * math.log(2 * math.pi) + ready.log_constant
    p_detect = np.broadcast_to(sensor.detects(x), x.shape[:-1])
    columns = np.empty((*x.shape[:-2], 1 + nu.shape[-3], x.shape[-2]))
    columns[..., 0, :] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:, :] = loglik + kernels.safe_log(p_detect)[..., None, :]
    return columns


def particle_innovation(
    particles: Particles, likelihoods: Array, state: Space, sensor: Sensor, detections: Detections, detail: object
) -> Innovation:
    """Return the `point_likelihoods` averaged over the points, with distances by the moments of the points' measurements."""
    x, weights = particles.points[..., state.locate(sensor.observes)], point_weights(particles.log_weights)
    expected, dz = sensor.measurement.mean(sensor.measure(x), weights)
    R = sensor.noise(x)
    if R.ndim > 2:
        R = np.sum(weights[..., None, None] * R, axis=-3)
    ready = prepare(sensor, detections, expected, R)
    rows = (dz * np.sqrt(weights)[..., None])[..., None, :, :]
    inverse, log_det, _ = kernels.gains_of_points(rows[..., :0], ready.columns(rows), ready.noise)
    distance = np.sum(ready.residuals * (inverse @ ready.residuals[..., None])[..., 0], axis=-1)
    loglik = kernels.log_sum(likelihoods + particles.log_weights[..., None, :])
    volume = np.broadcast_to(np.max(0.5 * log_det, axis=-1, initial=-np.inf), loglik.shape[:-1])
    return Innovation(loglik, distance, volume, distance, detail)


def log_association(likelihoods: Array, loglik: Array, weights: Array) -> Array:
    """Return log of sum_i W_i l_i(x) / l_i, the factor by which association reweights every point x: (*b, t, p).

    likelihoods (*b, t, 1+k, p), loglik and association weights (*b, t, 1+k). Where nothing is possible, 0 as if undetected.
    """
    with np.errstate(divide="ignore"):
        log_share = np.log(weights) - np.where(np.isfinite(loglik), loglik, 0.0)
    total = kernels.log_sum(likelihoods + log_share[..., None], axis=-2)
    return np.where(np.isfinite(np.max(total, axis=-1, keepdims=True)), total, 0.0)


def normalised(log_weights: Array) -> Array:
    """Return log weights (*b, t, p) that sum to 1."""
    return log_weights - kernels.log_sum(log_weights)[..., None]
