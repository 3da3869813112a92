"""The IMM's smoothing step: from each mode's smoothed belief to that of each mode one step earlier.

Of mode i before and mode j after, with the mode's future likelihood L_j(x') = N(x'; s_j, S_j) / N(x'; m_j, P_j), smoothed
over predicted, Bayes gives p(x, i | all) = sum_j mu_j p(i, x | j, all), and for each pair

    p(i | j, all) ~ p_ij mu_i integral N(x'; m_ij, P_ij) L_j(x') dx',    x' | i, j, all ~ N(x'; m_ij, P_ij) L_j(x'),

where N(m_ij, P_ij) predicts mode i's filtered belief by mode j. Mode j's own smoothing step leads from x' | i, j to
x | i, j.
"""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Space, kernels


@frozen(eq=False)
class FutureLikelihood:
    """L_j in the coordinates where the prediction is N(0, I): y = turn (x' - m_j).

    `info` (*b, n) on the diagonal, no less than 0; `pull` (*b, n), so that log L_j = pull'y - y'(info)y / 2 + constant;
    `growth` (*b, n): the factor of standard deviations where the smoothed belief is the wider one, else 1.
    """

    turn: Array
    back: Array
    info: Array
    pull: Array
    growth: Array


def future_likelihood(predicted: Gaussian, smoothed: Gaussian, state: Space) -> FutureLikelihood:
    """Return what the scans after a prediction said, from what it was and what it became; (*b, n) each.

    Where association left the smoothed belief wider than the prediction, no likelihood can express it. There the information
    is 0, and the pair's belief is widened by the same factor: so a single mode's smoothing step is the usual one.
    """
    n = len(state)
    lower = kernels.root(predicted.cov)
    pivots = np.diagonal(lower, axis1=-2, axis2=-1) > 0
    whole = lower + np.where(pivots, 0.0, 1.0)[..., None] * np.eye(n)
    white = np.linalg.inv(whole)
    cov = white @ smoothed.cov @ np.swapaxes(white, -1, -2) + (whole - lower)
    part, axes = np.linalg.eigh(0.5 * (cov + np.swapaxes(cov, -1, -2)))
    turn = np.swapaxes(axes, -1, -2) @ white
    part = np.maximum(part, 1e-12)
    info = np.maximum(1.0 / part - 1.0, 0.0)
    known = (white @ state.difference(smoothed.mean, predicted.mean)[..., None]) * pivots[..., None]
    shift = (np.swapaxes(axes, -1, -2) @ known)[..., 0]
    return FutureLikelihood(turn, whole @ axes, info, (1.0 + info) * shift, np.sqrt(np.maximum(part, 1.0)))


def pair_posterior(predicted: Gaussian, origin: Array, seen: FutureLikelihood, state: Space) -> tuple[Gaussian, Array]:
    """Return a pair's prediction (*b, r, n) times L_j, and the log of its integral (*b, r); `origin` is m_j (*b, n)."""
    turn, back = seen.turn[..., None, :, :], seen.back[..., None, :, :]
    apart = (turn @ state.difference(predicted.mean, origin[..., None, :])[..., None])[..., 0]
    P = turn @ predicted.cov @ np.swapaxes(turn, -1, -2)
    scale = np.sqrt(seen.info)[..., None, :]
    inner = np.eye(len(state)) + scale[..., :, None] * P * scale[..., None, :]
    gain = np.swapaxes(np.linalg.solve(inner, scale[..., :, None] * P), -1, -2)
    keep = np.eye(len(state)) - gain * scale[..., None, :]
    cov = keep @ P @ np.swapaxes(keep, -1, -2) + gain @ np.swapaxes(gain, -1, -2)
    pull = seen.pull[..., None, :] - seen.info[..., None, :] * apart
    step = (cov @ pull[..., None])[..., 0]
    log_weight = np.sum(
        (seen.pull[..., None, :] - 0.5 * seen.info[..., None, :] * apart) * apart + 0.5 * pull * step, axis=-1
    )
    log_weight = log_weight - 0.5 * np.linalg.slogdet(inner)[1]
    wide = back * seen.growth[..., None, None, :]
    cov = wide @ cov @ np.swapaxes(wide, -1, -2)
    shift = (back @ (apart + step)[..., None])[..., 0]
    mean = state.displace(np.broadcast_to(origin[..., None, :], shift.shape), shift)
    return Gaussian(mean, 0.5 * (cov + np.swapaxes(cov, -1, -2))), log_weight


def gain_over_all_axes(now: Gaussian, own: list[int], back: Gaussian, state: Space) -> tuple[Array, Array]:
    """Return what all axes of `now` (*b, n) gain where some of them, `own`, became known as `back`: shift and covariance."""
    step = state.difference(_embedded(now.mean, own, back.mean), now.mean)[..., own]
    if len(own) == len(state):
        shift, cov = np.zeros_like(now.mean), np.zeros_like(now.cov)
        shift[..., own] = step
        cov[..., np.array(own)[:, None], own] = back.cov
        return shift, cov
    seen = now.cov[..., own, :][..., own]
    return kernels.smooth_step(now.cov, seen, now.cov[..., :, own], step, back.cov)


def _embedded(mean: Array, own: list[int], part: Array) -> Array:
    whole = mean.copy()
    whole[..., own] = part
    return whole


def log_pair_probability(log_prior: Array, log_weight: Array) -> Array:
    """Return logarithm of p(i | j, all) (*b, r), from mu_i and p_ij times the integral; mu_i where no mode leads to j."""
    joint = log_prior + log_weight
    total = kernels.log_sum(joint)[..., None]
    reached = np.isfinite(total)
    return np.where(reached, joint - np.where(reached, total, 0.0), log_prior)
