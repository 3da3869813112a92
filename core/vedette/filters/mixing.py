"""Mixtures of Gaussians replaced by the Gaussian of the same moments."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.kernels.boxes import by_width
from vedette.space import Array, Space
from vedette.types import Gaussian, Mixtures


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


def merged(estimates: Gaussian, mixtures: Mixtures, state: Space) -> Gaussian:
    """Return the moments of mixtures of the same estimates in several shares.

    Parameters
    ----------
    estimates
        Means (l, n) and covariances (l, n, n) over `state`.
    mixtures
        What each is a mixture of.
    state
        The axes: angles are averaged on their circle.

    Returns
    -------
    Gaussian
        Means (count, n) and covariances (count, n, n).
    """
    into, parts, shares, count = mixtures.into, mixtures.parts, mixtures.shares, mixtures.count
    order = np.lexsort((-shares, into))  # the largest first: angles are averaged around it
    parts, shares = parts[order], shares[order]
    n = len(state)
    mean, cov = np.empty((count, n)), np.empty((count, n, n))
    for rows, at, there in by_width(np.bincount(into, minlength=count)):
        each = Gaussian(estimates.mean[parts[at]], estimates.cov[parts[at]])
        if at.shape[1] == 1:  # what is alone stays as it is
            mean[rows], cov[rows] = each.mean[:, 0], each.cov[:, 0]
            continue
        several = mixed(each, np.where(there, shares[at], 0.0), state)
        mean[rows], cov[rows] = several.mean, several.cov
    return Gaussian(mean, cov)
