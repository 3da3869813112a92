"""How far a filter's covariances are from its errors, in decibels."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.metrics import nees
from vedette.space import Array


@frozen
class Credibility:
    """How far covariances are from the errors, in dB: 0 is right, 3 a factor of 2.

    `index` counts both directions; `inclination` is > 0 where covariances are too small, < 0 where they are too large.
    """

    index: float
    inclination: float


def noncredibility(error: Array, cov: Array) -> Credibility:
    """Return the noncredibility and inclination indices, 10 mean |log10 rho| and 10 mean log10 rho, in dB.

    rho = e' P^-1 e / e' S^-1 e with S the mean square error matrix over the runs: error (*b, r, n), cov (*b, r, n, n).
    S comes from the same runs, so `index` of a correct filter is above 0 by about 3.5 sqrt(2 / r).
    Li, Zhao, Measuring Estimator's Credibility: Noncredibility Index, Int. Conf. on Information Fusion, 2006.
    """
    error = np.where(np.diagonal(cov, axis1=-2, axis2=-1) > 0, error, 0.0)
    runs, n = error.shape[-2:]
    if runs <= n:
        raise ValueError(f"error: needs more runs than axes ({n}), got {runs}")
    square = (np.swapaxes(error, -1, -2) @ error / runs)[..., None, :, :]
    stated, found = nees(error, cov), nees(error, square)
    decibel = 10.0 * np.log10(stated[found > 0] / found[found > 0])  # an error of exactly 0 tells nothing
    return Credibility(float(np.mean(np.abs(decibel))), float(np.mean(decibel)))
