"""Errors of runs that one has by oneself, of any filter, with the run as the unit."""

from __future__ import annotations

import numpy as np

from vedette.metrics import Estimate, Verdict, chi_square_verdict, mean_over_runs, normalised_error
from vedette.space import Array


def rmse_over_runs(error: Array) -> Estimate:
    """Return the root mean square error over runs, (r, *b, d), and its standard error, with the run as the unit.

    By the delta method: the standard error of the mean square over twice its root. Scans of a run are dependent, so
    only runs count; one run has no standard error.
    """
    square = mean_over_runs(np.mean(np.sum(error**2, axis=-1).reshape(len(error), -1), axis=-1))
    root = float(np.sqrt(square.value))
    if square.error is None:
        return Estimate(root, None)
    return Estimate(root, square.error / (2.0 * root) if root > 0 else 0.0)


def calibration_verdicts(error: Array, cov: Array, axes: tuple[str, ...], alpha: float) -> tuple[Verdict, ...]:
    """Judge each axis' mean squared error over its variance, at one time over runs; error (r, n), cov (r, n, n).

    Chi-square with r degrees of freedom where the filter is linear and Gaussian; `alpha` is shared among the axes. Axes
    without variance are left out.
    """
    squares = normalised_error(error, cov) ** 2
    free = np.flatnonzero(np.any(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=tuple(range(cov.ndim - 2))))
    return tuple(chi_square_verdict(f"variance of {axes[i]}", squares[:, i], 1.0, alpha / len(free)) for i in free)
