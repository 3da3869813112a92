"""Errors of runs that one has by oneself, of any filter, with the run as the unit."""

from __future__ import annotations

import numpy as np

from vedette.space import Array
from vedette_report.consistency import (
    Estimate,
    Verdict,
    chi_square_verdict,
    mean_over_runs,
    normalised_error,
    run_mean_verdict,
)


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


def equivalence_verdict(name: str, values: Array, low: float, high: float, alpha: float) -> Verdict:
    """Judge whether one value per run (r,), scaled to 1, proves that its mean lies in the equivalence band [low, high].

    The band is narrowed by Student's quantile of the standard error: a filter whose mean is outside of it passes with
    probability alpha at most. Too few runs narrow it to nothing (low > high): never inside, and the text says so.
    """
    loose = run_mean_verdict(name, values, low, high, alpha, -np.inf)
    reach, figure = loose.high - high, f"{name}: {loose.figure:.3g} with a standard error of {loose.error:.2g}"
    text = f"{figure}, to be in {low + reach:.3g} to {high - reach:.3g} (equivalence band {low:g} to {high:g})"
    if low + reach > high - reach:
        text = f"{figure}: too few runs to tell {low:g} from {high:g}"
    return Verdict(name, loose.figure, low + reach, high - reach, alpha, text, loose.error)


def calibration_verdicts(error: Array, cov: Array, axes: tuple[str, ...], alpha: float) -> tuple[Verdict, ...]:
    """Judge each axis' mean squared error over its variance, at one time over runs; error (r, n), cov (r, n, n).

    Chi-square with r degrees of freedom where the filter is linear and Gaussian; `alpha` is shared among the axes. Axes
    without variance are left out.
    """
    squares = normalised_error(error, cov) ** 2
    free = np.flatnonzero(np.any(np.diagonal(cov, axis1=-2, axis2=-1) > 0, axis=tuple(range(cov.ndim - 2))))
    return tuple(chi_square_verdict(f"variance of {axes[i]}", squares[:, i], 1.0, alpha / len(free)) for i in free)
