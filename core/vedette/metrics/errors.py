"""Errors of estimates against the truth."""

from __future__ import annotations

import numpy as np

from vedette.metrics.consistency import Estimate, mean_over_runs
from vedette.space import Array


def rmse(error: Array) -> float:
    """Return the root mean square error of vectors (*b, d) over `b`, the d axes added; ValueError if there is none."""
    if not error.size:
        raise ValueError("error: holds no vector")
    return float(np.sqrt(np.mean(np.sum(error**2, axis=-1))))


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
