"""The kernels of a bank of filters: its modes are mixed, weighted by the scan, and combined.

Each mode's arrays are separate, in tuples of r: modes may have different states. `own` names each mode's axes among the n
of all of them; `absent` (2, n) holds the mean and the variance that an axis has in the modes that lack it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.kernels.reference import exp_or_zero, log_sum, moments, normal_or_zero
from vedette.space import Array, Periods, wrapped


def stacked(
    xs: Sequence[Array], Ps: Sequence[Array], own: Sequence[Sequence[int]], absent: Array, periods: Periods
) -> tuple[Array, Array, Array]:
    """Return all modes over the same axes: an origin (*b, n), means from there (*b, r, n), covariances (*b, r, n, n)."""
    n, shape = absent.shape[-1], (*xs[0].shape[:-1], len(xs))
    means, covs = np.empty((*shape, n)), np.zeros((*shape, n, n))
    means[:] = absent[0]
    covs[..., range(n), range(n)] = absent[1]
    for j, axes in enumerate(own):
        means[..., j, axes] = xs[j]
        covs[..., j, np.array(axes)[:, None], axes] = Ps[j]
    origin = means[..., 0, :]
    return origin, wrapped(means - origin[..., None, :], periods), covs


def mix_modes(
    log_prob: Array,
    log_transition: Array,
    xs: Sequence[Array],
    Ps: Sequence[Array],
    own: Sequence[Sequence[int]],
    absent: Array,
    periods: Periods,
) -> tuple[Array, tuple[Array, ...], tuple[Array, ...]]:
    """Mix the modes: predicted log_prob (*b, r), and the mean and covariance that each starts from, on its own axes.

    xs: r arrays (*b, n_j), Ps: r arrays (*b, n_j, n_j); log_transition (r, r) from row to column. An unreachable mode
    starts from the whole mixture.
    """
    origin, apart, covs = stacked(xs, Ps, own, absent, periods)
    predicted, means, mixed = imm_mix(log_prob, log_transition, apart, covs)
    means = wrapped(origin[..., None, :] + means, periods)
    return (
        predicted,
        tuple(means[..., j, axes] for j, axes in enumerate(own)),
        tuple(mixed[..., j, np.array(axes)[:, None], axes] for j, axes in enumerate(own)),
    )


def mixture_moments(
    log_prob: Array, xs: Sequence[Array], Ps: Sequence[Array], own: Sequence[Sequence[int]], absent: Array, periods: Periods
) -> tuple[Array, Array]:
    """Return mean (*b, n) and covariance (*b, n, n) of the mixture of all modes, the spread of their means included."""
    origin, apart, covs = stacked(xs, Ps, own, absent, periods)
    step, cov = moments(exp_or_zero(log_prob)[..., None, :], apart, covs)
    return wrapped(origin + step[..., 0, :], periods), cov[..., 0, :, :]


def weigh_modes(
    log_prob: Array, said: Sequence[tuple[Array, Array, Array, Array]]
) -> tuple[Array, Array, Array, Array, Array]:
    """Combine the modes' evaluations: loglik (*b, 1+k), least distance (*b, k), largest log volume (*b), the squared
    distance expected over modes (*b, k), and the log posterior of the modes under each hypothesis (*b, 1+k, r).

    log_prob (*b, r); of each mode loglik (*b, 1+k), distance (*b, k), log volume (*b) and its own expected distance (*b, k).
    """
    logliks, distances, log_volumes, nis = zip(*said, strict=True)
    joint = np.stack(logliks, axis=-1) + log_prob[..., None, :]
    loglik = log_sum(joint)
    share = joint - loglik[..., None]
    expected = np.sum(exp_or_zero(share[..., 1:, :]) * np.stack(nis, axis=-1), axis=-1)
    return loglik, np.minimum.reduce(distances), np.maximum.reduce(log_volumes), expected, share


def split_weights(weights: Array, log_share: Array) -> tuple[Array, tuple[Array, ...]]:
    """Return the modes' log probabilities (*b, r) after association, and each mode's weights, r arrays (*b, 1+k).

    weights (*b, 1+k) of the whole, log_share (*b, 1+k, r). An impossible mode keeps the weights of the whole.
    """
    with np.errstate(divide="ignore"):
        joint = np.log(weights)[..., None] + log_share
    log_prob = log_sum(joint, axis=-2)
    possible = np.isfinite(log_prob)[..., None, :]
    own = np.where(possible, exp_or_zero(joint - np.where(possible, log_prob[..., None, :], 0.0)), weights[..., None])
    own = normal_or_zero(own)
    after = log_prob - log_sum(log_prob)[..., None]
    return after, tuple(np.ascontiguousarray(own[..., j]) for j in range(own.shape[-1]))


def imm_mix(log_prob: Array, log_transition: Array, xs: Array, Ps: Array) -> tuple[Array, Array, Array]:
    """Mix the modes of the IMM: predicted log_prob c (*b, r), and the mean and covariance that each mode starts from.

    log_prob (*b, r), log_transition (r, r) from row to column, xs (*b, r, n), Ps (*b, r, n, n)
    """
    joint = np.swapaxes(log_prob[..., :, None] + log_transition, -1, -2)  # (*b, to, from)
    predicted = log_sum(joint)
    # An unreachable mode starts from the whole mixture: any prior will do, but there must be one.
    reached = np.isfinite(predicted)[..., None]
    logs = np.where(reached, joint - np.where(reached, predicted[..., None], 0.0), log_prob[..., None, :])
    return predicted, *moments(exp_or_zero(logs), xs, Ps)


def imm_combine(log_prob: Array, loglik: Array, xs: Array, Ps: Array) -> tuple[Array, Array, Array, Array]:
    """Combine the IMM after a scan: log_prob (*b, r) by Bayes' rule, mean (*b, n) and covariance (*b, n, n) of the mixture,
    and the log-likelihood of the scan (*b).

    log_prob (*b, r) predicted, loglik (*b, r) of the scan in each mode, xs (*b, r, n), Ps (*b, r, n, n)
    """
    joint = log_prob + loglik
    total = log_sum(joint)
    after = joint - total[..., None]
    mean, cov = moments(exp_or_zero(after)[..., None, :], xs, Ps)
    return after, mean[..., 0, :], cov[..., 0, :, :], total
