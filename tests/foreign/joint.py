"""The part that foreign Gaussian filters share: the joint deviations of state and measurement become an innovation."""

import numpy as np

import vedette
from vedette.filters import Hypotheses, make_innovation, prepare


def observed_first(state, observes, cov):
    """Return the root L of a covariance, L L' = P, in the state's order, whose first len(observes) columns give the observed
    axes alone; and the observed axes' indices.
    """
    where = state.locate(observes)
    order = [*where, *(i for i in range(len(state)) if i not in where)]
    root = vedette.kernels.root(cov[..., order, :][..., order])
    back = np.argsort(order)
    return root[..., back, :], where


def innovation(sensor, observed, x, expected, A, D, p_gate, noise=None):
    """Return the innovation whose joint covariance is [A; D] [A; D]' plus the noise of the measurement.

    A (*b, t, n, s) and D (*b, t, m, s) are deviations times roots of their weights, x (*b, t, o) the observed axes, expected
    (*b, t, m). S = D D' + R, K = A D' S^-1, and the posterior (A - K D) (A - K D)' + K R K' is PSD by construction.
    """
    ready = prepare(sensor, observed, expected, sensor.noise(x) if noise is None else noise)
    D = np.swapaxes(ready.columns(np.swapaxes(D, -1, -2)[..., None, :, :]), -1, -2)  # (*b, t, 1|k, m, s)
    A = A[..., None, :, :]
    S = D @ np.swapaxes(D, -1, -2) + ready.noise
    gain = np.swapaxes(np.linalg.solve(S, D @ np.swapaxes(A, -1, -2)), -1, -2)  # (*b, t, 1|k, n, m)
    return with_gain(sensor, x, ready, A, D, S, gain, p_gate)


def with_gain(sensor, x, ready, A, D, S, gain, p_gate):
    """Return the innovation by a gain (*b, t, 1|k, n, m): its posterior covariance is right for any of them."""
    rest = A - gain @ D
    post = rest @ np.swapaxes(rest, -1, -2) + gain @ ready.noise @ np.swapaxes(gain, -1, -2)
    shift = (gain @ ready.residuals[..., None])[..., 0]
    root = np.linalg.cholesky(S)
    white = np.linalg.solve(root, ready.residuals[..., None])[..., 0]
    distance = np.sum(white**2, axis=-1)
    volume = np.log(np.diagonal(root, axis1=-2, axis2=-1)).sum(axis=-1)
    loglik = -0.5 * (distance + ready.residuals.shape[-1] * np.log(2 * np.pi)) - volume + ready.log_constant
    return make_innovation(sensor, x, p_gate, loglik, distance, volume, Hypotheses(shift, post))
