"""Draw from normal distributions whose covariances may be singular."""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.space import Array


def psd_root(cov: Array) -> Array:
    """Return the lower triangular L with L L' = cov: Cholesky's, but singular covariances are allowed.

    Parameters
    ----------
    cov
        Covariances (*b, n, n).

    Returns
    -------
    array
        L (*b, n, n).

    Raises
    ------
    ValueError
        If `cov` is not symmetric positive semi-definite.
    """
    lower = kernels.root(cov)
    # A variance of 0 may have fallen below the least number: what covaries with it need not be 0 then.
    deviation = np.sqrt(np.maximum(np.diagonal(cov, axis1=-2, axis2=-1), np.finfo(float).tiny))
    left = np.abs(lower @ np.swapaxes(lower, -1, -2) - cov)
    if not np.all(left <= 1e-6 * deviation[..., :, None] * deviation[..., None, :]):
        raise ValueError(f"covariance: must be symmetric positive semi-definite, got {cov}")
    return lower


def spread(lower: Array, standard: Array) -> Array:
    """Return L w; one product for all of them if L (n, n) is the same for all."""
    return standard @ lower.T if lower.ndim == 2 else (lower @ standard[..., None])[..., 0]


def draw_gaussian(mean: Array, cov: Array, rng: np.random.Generator, size: tuple[int, ...] = ()) -> Array:
    """Draw from N(mean, cov).

    Parameters
    ----------
    mean
        Means (*b, n).
    cov
        Covariances (*b, n, n), singular or not.
    rng
        The generator that is drawn from.
    size
        Batch axes: so many draws are made of each.

    Returns
    -------
    array
        Draws (*size, *b, n).
    """
    return mean + spread(psd_root(cov), rng.standard_normal((*size, *np.shape(mean))))
