"""What particle filters share: weighted points, their moments, resampling, and what returns say to each point."""

from __future__ import annotations

import math

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, Detections, Gaussian, Innovation, MotionModel, Sensor, Space, kernels
from vedette.filters.gaussian import among_present, missing_share, reported, without_variance
from vedette.sampling.trajectories import factor
from vedette.space import Mask


@frozen(eq=False)
class Cloud:
    """Points (*b, t, p, n) and the logarithms of their weights (*b, t, p), which sum to 1."""

    points: Array
    log_weights: Array


def own_frame(motion: MotionModel) -> None:
    """ValueError for a model whose beliefs are re-expressed on the way: it does so for Gaussians only."""
    if type(motion).reframe is not MotionModel.reframe:
        raise ValueError(f"motion: {motion.kind!r} turns its frame with its target, which particles cannot follow")


def scatter(prior: Gaussian, count: int, rng: np.random.Generator) -> Array:
    """Points (*b, t, p, n) with just the prior's mean and covariance: draws, whitened by their own moments."""
    standard = rng.standard_normal((*prior.mean.shape[:-1], count, prior.mean.shape[-1]))
    standard -= np.mean(standard, axis=-2, keepdims=True)
    spread = np.swapaxes(standard, -1, -2) @ standard / count
    white = standard @ np.swapaxes(np.linalg.inv(np.linalg.cholesky(spread)), -1, -2)
    return prior.mean[..., None, :] + white @ np.swapaxes(factor(prior.cov), -1, -2)


def moments(cloud: Cloud, state: Space, zero_variance: Space) -> Gaussian:
    """Mean (*b, t, n) and covariance (*b, t, n, n); zero-variance axes have no variance."""
    weights = np.exp(cloud.log_weights)
    mean, apart = state.mean(cloud.points, weights)
    cov = kernels.symmetric(np.swapaxes(apart * weights[..., None], -1, -2) @ apart)
    return Gaussian(mean, without_variance(cov, state.locate(zero_variance)) if len(zero_variance) else cov)


def too_few(log_weights: Array, least: float) -> Mask:
    """Where the effective number of points, 1 / sum w^2, is below the share `least` of all: (*b, t, p) -> (*b, t)"""
    few: Mask = np.exp(kernels.log_sum(2 * log_weights)) * least * log_weights.shape[-1] > 1.0
    return few


def chosen(log_weights: Array, offset: Array) -> NDArray[np.intp]:
    """Systematic resampling: which points (*b, t, p) the new ones come from; `offset` (*b, t) uniform in [0, 1).

    Kitagawa, Monte Carlo Filter and Smoother for Non-Gaussian Nonlinear State Space Models, JCGS 5, 1996.
    """
    p = log_weights.shape[-1]
    rows = log_weights.reshape(-1, p)
    levels = np.cumsum(np.exp(rows), axis=-1)
    levels /= levels[:, -1:]
    marks = (np.arange(p) + offset.reshape(-1, 1)) / p
    # One sorted list for all rows: row i has the levels from i to i + 1.
    base = np.arange(len(rows))[:, None]
    index = np.searchsorted((levels + base).ravel(), (marks + base).ravel(), side="right").reshape(-1, p) - base * p
    inside: NDArray[np.intp] = np.clip(index, 0, p - 1).reshape(log_weights.shape)
    return inside


def taken(points: Array, index: NDArray[np.intp]) -> Array:
    """`points` (*b, t, p, n) at `index` (*b, t, p)"""
    return np.take_along_axis(points, index[..., None], axis=-2)


def likelihoods(points: Array, state: Space, sensor: Sensor, detections: Detections, p_gate: float) -> Array:
    """Log likelihood of a miss (column 0) and of every return at every point: (*b, t, 1+k, p)"""
    x = points[..., state.locate(sensor.observes)]
    nu = sensor.measurement.difference(detections.z[..., None, :, None, :], sensor.measure(x)[..., :, None, :, :])
    if detections.noise is not None:
        R = detections.noise[..., None, :, None, :, :]
    else:
        R = sensor.noise(x)
        R = R[..., None, :, :, :] if R.ndim > 2 else R
    share: Array | float = 0.0
    if detections.missing is not None:
        there = reported(detections)[..., None, :]
        R, nu, share = among_present(R, there), np.where(there, nu, 0.0), missing_share(there)
    root = np.linalg.cholesky(R)
    white = (np.linalg.inv(root) @ nu[..., None])[..., 0]
    log_det = np.sum(np.log(np.diagonal(root, axis1=-2, axis2=-1)), axis=-1)
    loglik = -0.5 * np.sum(white**2, axis=-1) - log_det - 0.5 * nu.shape[-1] * math.log(2 * math.pi) + share
    p_detect = np.broadcast_to(sensor.detects(x), x.shape[:-1])
    columns = np.empty((*x.shape[:-2], 1 + nu.shape[-3], x.shape[-2]))
    columns[..., 0, :] = kernels.safe_log(1.0 - p_detect * p_gate)
    columns[..., 1:, :] = loglik + kernels.safe_log(p_detect)[..., None, :]
    return columns


def innovation(
    cloud: Cloud, columns: Array, state: Space, sensor: Sensor, detections: Detections, detail: object
) -> Innovation:
    """The columns (*b, t, 1+k, p) averaged over the points; distances by the moments of what the points would give."""
    x, weights = cloud.points[..., state.locate(sensor.observes)], np.exp(cloud.log_weights)
    expected, dz = sensor.measurement.mean(sensor.measure(x), weights)
    R = sensor.noise(x)
    if detections.noise is not None:
        R = detections.noise[..., None, :, :, :]
    elif R.ndim > 2:
        R = np.sum(weights[..., None, None] * R, axis=-3)[..., None, :, :]
    spread = (np.swapaxes(dz * weights[..., None], -1, -2) @ dz)[..., None, :, :]
    nu = sensor.measurement.difference(detections.z[..., None, :, :], expected[..., :, None, :])
    if detections.missing is not None:
        there = reported(detections)
        both = there[..., :, None] & there[..., None, :]
        R, spread, nu = among_present(R, there), np.where(both, spread, 0.0), np.where(there, nu, 0.0)
    S = spread + R
    distance = np.sum(nu * np.linalg.solve(S, nu[..., None])[..., 0], axis=-1)
    log_volume = np.max(0.5 * np.linalg.slogdet(S)[1], axis=-1, initial=-np.inf)
    loglik = kernels.log_sum(columns + cloud.log_weights[..., None, :])
    return Innovation(loglik, distance, np.broadcast_to(log_volume, loglik.shape[:-1]), distance, detail)


def claim(columns: Array, loglik: Array, weights: Array) -> Array:
    """Log of sum_i W_i l_i(x) / l_i, what association makes of the returns at every point: (*b, t, p)

    columns (*b, t, 1+k, p), loglik and association weights (*b, t, 1+k). Where nothing is possible, 0 as if not seen.
    """
    with np.errstate(divide="ignore"):
        log_share = np.log(weights) - np.where(np.isfinite(loglik), loglik, 0.0)
    total = kernels.log_sum(columns + log_share[..., None], axis=-2)
    return np.where(np.isfinite(np.max(total, axis=-1, keepdims=True)), total, 0.0)


def normal(log_weights: Array) -> Array:
    """Log weights (*b, t, p) that sum to 1."""
    return log_weights - kernels.log_sum(log_weights)[..., None]
