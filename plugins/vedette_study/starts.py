"""Priors from the first returns, as published studies start their filters."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vedette import Gaussian, Space


def two_point(first: Gaussian, second: Gaussian, dt: float) -> Gaussian:
    """Start position and velocity from two positions (*b, d) `dt` s apart: mean (*b, 1, 2d), the track's axis added.

    v = (z2 - z1)/T; cov = [R2 R2/T; R2/T (R1 + R2)/T^2]: the information in both, ignoring process noise in between.
    """
    d = first.mean.shape[-1]
    mean = np.concatenate([second.mean, (second.mean - first.mean) / dt], axis=-1)
    cov = np.zeros((*mean.shape, 2 * d))
    cov[..., :d, :d] = second.cov
    cov[..., :d, d:] = cov[..., d:, :d] = second.cov / dt
    cov[..., d:, d:] = (first.cov + second.cov) / dt**2
    return Gaussian(mean[..., None, :], cov[..., None, :, :])


def over_axes(prior: Gaussian, space: Space, state: Space, rest: Mapping[str, tuple[float, float]]) -> Gaussian:
    """Extend a prior over `space` to `state`, whose further axes have the [mean, standard deviation] of `rest`."""
    n = len(state)
    mean, cov = np.zeros((*prior.mean.shape[:-1], n)), np.zeros((*prior.mean.shape[:-1], n, n))
    known = [name for name in state.names if name in space]
    there, here = [[axes.names.index(name) for name in known] for axes in (space, state)]
    mean[..., here] = prior.mean[..., there]
    cov[..., np.array(here)[:, None], here] = prior.cov[..., there, :][..., there]
    for i, name in enumerate(state.names):
        if name not in space:
            mean[..., i], cov[..., i, i] = rest[name][0], rest[name][1] ** 2
    return Gaussian(mean, cov)
