"""Squared errors over their covariances: NEES and NIS, and what of a chi-square lies within a gate or a band.

Pure functions of arrays: `n` state axes, `m` measured axes, `*b` any batch axes. `vedette_report.consistency` judges them.
"""

from __future__ import annotations

import numpy as np

from vedette import kernels
from vedette.space import Array, Mask


def nees(error: Array, cov: Array) -> Array:
    """Return the normalised estimation error squared e' P^-1 e, skipping axes without variance: (*b, n), (*b, n, n) -> (*b).

    That of an innovation and its covariance is the NIS. It is chi-square with `free_axes(cov)` degrees of freedom if the
    filter is linear, Gaussian and correct.
    """
    if asymmetric(cov).any():
        raise ValueError("cov: must be symmetric, got one that is not")  # of which one triangle alone would be taken
    return np.sum(kernels.whiten(error, cov) ** 2, axis=-1)


def asymmetric(cov: Array) -> Mask:
    """Return which covariances are not symmetric, beyond rounding: (*b, n, n) -> (*b), or () if all are to the last bit."""
    off = cov - np.swapaxes(cov, -1, -2)
    return np.asarray(off.any() and np.max(np.abs(off), axis=(-2, -1)) > 1e-6 * np.max(np.abs(cov), axis=(-2, -1)))


def free_axes(cov: Array) -> Array:
    """Count the axes that have variance: (*b, n, n) -> (*b)."""
    return np.sum(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=-1, dtype=float)


def gate_truncation(axes: Array | int, gate_probability: Array | float) -> Array:
    """Return the mean NIS of returns inside a gate over that of all: P(chi2_{m+2} < g) / P(chi2_m < g), m of any shape.

    As x f_m(x) = m f_{m+2}(x), the mean of chi2_m below g is m P(chi2_{m+2} < g) / P(chi2_m < g).
    """
    from scipy.special import gammainc

    half = 0.5 * kernels.gate_threshold(axes, gate_probability)
    return gammainc(np.asarray(axes) / 2.0 + 1.0, half) / gate_probability


def within_gate(nis: Array, hit: Array, axes: Array | int, gate_probability: Array | float) -> Mask:
    """Return whether a scan's returns, of the weighted NIS and the sum of the weights `hit`, were in the gate on average.

    Those beyond it that count as a sure track's own are not of the cut chi-square, whose mean is `gate_truncation`.
    """
    return nis <= kernels.gate_threshold(axes, gate_probability) * np.maximum(hit, 1e-300)


def chi_square_band(dof: float, alpha: float) -> tuple[float, float]:
    """Return the two-sided band of a chi-square sum with `dof` degrees of freedom in total, over `dof`: around 1.

    For the average of N values of n degrees each, dof = N n. The half-width is about z sqrt(2 / dof).
    """
    from scipy.special import gammainccinv, gammaincinv

    if not (dof > 0 and 0 < alpha < 1):
        raise ValueError(f"dof: must be > 0, and alpha in (0, 1), got {dof} and {alpha}")
    return float(gammaincinv(dof / 2, alpha / 2)) * 2 / dof, float(gammainccinv(dof / 2, alpha / 2)) * 2 / dof
