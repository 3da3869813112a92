"""Boats a kilometre off, some m/s fast, for filters of position and velocity."""

import numpy as np

from vedette import Gaussian


def prior(n, *batch, seed=0):
    rng = np.random.default_rng(seed)
    scale = np.array([20.0, 20.0, 3.0, 3.0, 0.02])[:n]
    mean = np.array([800.0, 500.0, -10.0, 5.0, 0.05])[:n] + rng.normal(size=(*batch, n)) * scale
    a = scale[:, None] * (rng.normal(size=(*batch, n, n)) / 4 + np.eye(n))
    return Gaussian(mean, a @ np.swapaxes(a, -1, -2))


def start(estimator, *batch, seed=0):
    """Boats 1 km off, some m/s fast."""
    rng = np.random.default_rng(seed)
    n = len(estimator.state)
    mean = np.array([800.0, 500.0, -10.0, 5.0, 0.05])[:n] + rng.normal(size=(*batch, n)) * [30, 30, 3, 3, 0.02][:n]
    a = rng.normal(size=(*batch, n, n)) / 4 + np.eye(n)
    a = np.array([20.0, 20.0, 3.0, 3.0, 0.02])[:n, None] * a
    return estimator.start(Gaussian(mean, a @ np.swapaxes(a, -1, -2)), estimator.state, rng)
