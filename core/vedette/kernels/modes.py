"""The kernels of a bank of filters: its modes are mixed, weighted by the scan, and combined.

Each mode's arrays are separate, in tuples of r: modes may have different states. `axes_of` names each mode's axes among
the n of all of them; `absent` (2, n) holds the mean and the variance that an axis has in the modes that lack it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.kernels.reference import exp_or_zero, log_sum, moments, normal_or_zero
from vedette.kernels.results import Combined, Mixed, MixedMoments, Split, Stacked, Weighed
from vedette.space import Array, Periods, wrapped
from vedette.types import Gaussian


def stacked(
    xs: Sequence[Array], Ps: Sequence[Array], axes_of: Sequence[Sequence[int]], absent: Array, periods: Periods
) -> Stacked:
    """Return all modes over the same axes: an origin (*b, n), means from there (*b, r, n), covariances (*b, r, n, n)."""
    n, shape = absent.shape[-1], (*xs[0].shape[:-1], len(xs))
    means, covs = np.empty((*shape, n)), np.zeros((*shape, n, n))
    means[:] = absent[0]
    covs[..., range(n), range(n)] = absent[1]
    for j, axes in enumerate(axes_of):
        means[..., j, axes] = xs[j]
        covs[..., j, np.array(axes)[:, None], axes] = Ps[j]
    origin = means[..., 0, :]
    return Stacked(origin, wrapped(means - origin[..., None, :], periods), covs)


def mix_modes(
    log_prob: Array,
    log_transition: Array,
    xs: Sequence[Array],
    Ps: Sequence[Array],
    axes_of: Sequence[Sequence[int]],
    absent: Array,
    periods: Periods,
) -> Mixed:
    """Mix the modes: predicted log_prob (*b, r), and the mean and covariance that each starts from, on its own axes.

    xs: r arrays (*b, n_j), Ps: r arrays (*b, n_j, n_j); log_transition (r, r) from row to column. An unreachable mode
    starts from the whole mixture.
    """
    modes = stacked(xs, Ps, axes_of, absent, periods)
    mixed = imm_mix(log_prob, log_transition, modes.apart, modes.covs)
    means = wrapped(modes.origin[..., None, :] + mixed.means, periods)
    beliefs = tuple(
        Gaussian(means[..., j, axes], mixed.covs[..., j, np.array(axes)[:, None], axes]) for j, axes in enumerate(axes_of)
    )
    return Mixed(mixed.log_prob, beliefs)


def mixture_moments(
    log_prob: Array,
    xs: Sequence[Array],
    Ps: Sequence[Array],
    axes_of: Sequence[Sequence[int]],
    absent: Array,
    periods: Periods,
) -> Gaussian:
    """Return mean (*b, n) and covariance (*b, n, n) of the mixture of all modes, the spread of their means included."""
    modes = stacked(xs, Ps, axes_of, absent, periods)
    mixed = moments(exp_or_zero(log_prob)[..., None, :], modes.apart, modes.covs)
    return Gaussian(wrapped(modes.origin + mixed.mean[..., 0, :], periods), mixed.cov[..., 0, :, :])


def weigh_modes(log_prob: Array, said: Sequence[tuple[Array, Array, Array, Array]]) -> Weighed:
    """Combine the modes' evaluations: loglik (*b, 1+k), least distance (*b, k), largest log volume (*b), the squared
    distance expected over modes (*b, k), and the log posterior of the modes under each hypothesis (*b, 1+k, r).

    log_prob (*b, r); of each mode loglik (*b, 1+k), distance (*b, k), log volume (*b) and its own expected distance (*b, k).
    """
    logliks, distances, log_volumes, nis = zip(*said, strict=True)
    joint = np.stack(logliks, axis=-1) + log_prob[..., None, :]
    loglik = log_sum(joint)
    share = joint - loglik[..., None]
    expected = np.sum(exp_or_zero(share[..., 1:, :]) * np.stack(nis, axis=-1), axis=-1)
    return Weighed(loglik, np.minimum.reduce(distances), np.maximum.reduce(log_volumes), expected, share)


def split_weights(weights: Array, log_share: Array) -> Split:
    """Return the modes' log probabilities (*b, r) after association, and each mode's weights, r arrays (*b, 1+k).

    weights (*b, 1+k) of the whole, log_share (*b, 1+k, r). An impossible mode keeps the weights of the whole.
    """
    with np.errstate(divide="ignore"):
        joint = np.log(weights)[..., None] + log_share
    log_prob = log_sum(joint, axis=-2)
    possible = np.isfinite(log_prob)[..., None, :]
    shares = np.where(possible, exp_or_zero(joint - np.where(possible, log_prob[..., None, :], 0.0)), weights[..., None])
    shares = normal_or_zero(shares)
    after = log_prob - log_sum(log_prob)[..., None]
    return Split(after, tuple(np.ascontiguousarray(shares[..., j]) for j in range(shares.shape[-1])))


def imm_mix(log_prob: Array, log_transition: Array, xs: Array, Ps: Array) -> MixedMoments:
    """Mix the modes of the IMM: predicted log_prob c (*b, r), and the mean and covariance that each mode starts from.

    log_prob (*b, r), log_transition (r, r) from row to column, xs (*b, r, n), Ps (*b, r, n, n)
    """
    joint = np.swapaxes(log_prob[..., :, None] + log_transition, -1, -2)  # (*b, to, from)
    predicted = log_sum(joint)
    # An unreachable mode starts from the whole mixture: any prior will do, but there must be one.
    reached = np.isfinite(predicted)[..., None]
    logs = np.where(reached, joint - np.where(reached, predicted[..., None], 0.0), log_prob[..., None, :])
    mixed = moments(exp_or_zero(logs), xs, Ps)
    return MixedMoments(predicted, mixed.mean, mixed.cov)


def imm_combine(log_prob: Array, loglik: Array, xs: Array, Ps: Array) -> Combined:
    """Combine the IMM after a scan: log_prob (*b, r) by Bayes' rule, mean (*b, n) and covariance (*b, n, n) of the mixture,
    and the log-likelihood of the scan (*b).

    log_prob (*b, r) predicted, loglik (*b, r) of the scan in each mode, xs (*b, r, n), Ps (*b, r, n, n)
    """
    joint = log_prob + loglik
    total = log_sum(joint)
    after = joint - total[..., None]
    mixed = moments(exp_or_zero(after)[..., None, :], xs, Ps)
    return Combined(after, mixed.mean[..., 0, :], mixed.cov[..., 0, :, :], total)
