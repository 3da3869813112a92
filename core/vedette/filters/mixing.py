"""Mixtures of Gaussians replaced by the Gaussian of the same moments."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.space import Array, Space
from vedette.types import Gaussian


def mixed(parts: Gaussian, weights: Array, state: Space) -> Gaussian:
    """Return the moments of mixtures of Gaussians.

    Parameters
    ----------
    parts
        Means (*b, p, n) and covariances (*b, p, n, n) over `state`.
    weights
        Shares (*b, p), which sum to 1 over p.
    state
        The axes: angles are averaged on their circle.

    Returns
    -------
    Gaussian
        Mean (*b, n) and covariance (*b, n, n), the spread of the means included.
    """
    mean, apart = state.mean(parts.mean, weights)
    cov = np.einsum("...p,...pij->...ij", weights, parts.cov) + np.einsum("...p,...pi,...pj->...ij", weights, apart, apart)
    return Gaussian(mean, kernels.symmetric(cov))


def merged(estimates: Gaussian, shares: Array, state: Space) -> Gaussian:
    """Return the moments of mixtures of the same estimates in several shares.

    Parameters
    ----------
    estimates
        Means (l, n) and covariances (l, n, n) over `state`.
    shares
        Shares (s, l), which sum to 1 over l.
    state
        The axes: angles are averaged on their circle.

    Returns
    -------
    Gaussian
        Means (s, n) and covariances (s, n, n).
    """
    most = int(np.max(np.count_nonzero(shares, axis=-1), initial=0))
    rows = np.argsort(-shares, axis=-1, kind="stable")[:, :most]  # the largest first: angles are averaged around it
    parts = Gaussian(estimates.mean[rows], estimates.cov[rows])
    return mixed(parts, np.take_along_axis(shares, rows, axis=-1), state)
