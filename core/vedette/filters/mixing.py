"""Mixtures of Gaussians replaced by the Gaussian of the same moments."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.space import Array, Space
from vedette.types import Gaussian


def mixed(parts: Gaussian, weights: Array, state: Space) -> Gaussian:
    """Return the moments (*b, n) of mixtures of `parts` (*b, p, n) with `weights` (*b, p), which sum to 1."""
    mean, apart = state.mean(parts.mean, weights)
    cov = np.einsum("...p,...pij->...ij", weights, parts.cov) + np.einsum("...p,...pi,...pj->...ij", weights, apart, apart)
    return Gaussian(mean, kernels.symmetric(cov))


def merged(estimates: Gaussian, shares: Array, state: Space) -> Gaussian:
    """Return the moments (s, n) of mixtures of `estimates` (l, n) in the shares (s, l), which sum to 1 over l."""
    most = int(np.max(np.count_nonzero(shares, axis=-1), initial=0))
    rows = np.argsort(-shares, axis=-1, kind="stable")[:, :most]  # the largest first: angles are averaged around it
    parts = Gaussian(estimates.mean[rows], estimates.cov[rows])
    return mixed(parts, np.take_along_axis(shares, rows, axis=-1), state)
