"""The kernel of smoothing: later information carried back."""

from __future__ import annotations

import numpy as np

from vedette.kernels.reference import predict, root, symmetric
from vedette.kernels.results import Step
from vedette.space import Array, Periods, wrapped
from vedette.types import Gaussian


def solve_by_root(lower: Array, rows: Array) -> Array:
    """Return X (*b, p, q) with X L = rows, for L = `lower` (*b, q, q) as `root` makes it; 0 where that has no variance."""
    pivots = np.diagonal(lower, axis1=-2, axis2=-1)
    whole = lower + np.where(pivots > 0, 0.0, 1.0)[..., None] * np.eye(lower.shape[-1])
    return np.swapaxes(np.linalg.solve(np.swapaxes(whole, -1, -2), np.swapaxes(rows, -1, -2)), -1, -2)


def smooth_step(P: Array, ahead: Array, cross: Array, step: Array, later: Array, linear: tuple[Array, ...] = ()) -> Step:
    """Return the update of x, known as N(., P), by y that was predicted as N(., ahead) and is known as N(. + step, later).

    P (*b, n, n), ahead and later (*b, q, q), cross (*b, n, q) the covariance of x and y, step (*b, q) -> the shift of
    x's mean G step (*b, n) and its covariance D D' + G later G' (*b, n, n), where G = cross ahead^-1 and
    D D' = P - G ahead G'. Both come from one root of the joint covariance [ahead, cross'; cross, P], so the result is PSD,
    and what has no variance stays as it is. Where P is far larger than D D', as after a long gap, a difference loses its
    digits: `linear`, F and Q of y = F x + N(., Q), keeps them by D D' = (I - G F) P (I - G F)' + G Q G'.
    """
    q = ahead.shape[-1]
    joint = root(np.block([[ahead, np.swapaxes(cross, -1, -2)], [cross, P]]))
    gain, rest = solve_by_root(joint[..., :q, :q], joint[..., q:, :q]), joint[..., q:, q:]
    if linear:
        rest, later = (np.eye(q) - gain @ linear[0]) @ root(P), later + linear[1]
    cov = rest @ np.swapaxes(rest, -1, -2) + gain @ later @ np.swapaxes(gain, -1, -2)
    return Step((gain @ step[..., None])[..., 0], symmetric(cov))


def smooth_linear(x: Array, P: Array, F: Array, Q: Array, later: Array, cov: Array, periods: Periods) -> Gaussian:
    """Return x (*b, n) and P (*b, n, n) by what is known after a step of F and Q: a mean `later` and its covariance `cov`.

    The step of Rauch, Tung and Striebel, by `smooth_step`. periods: index and period of state axes that wrap.
    """
    ahead = predict(x, P, F, Q)
    P = np.broadcast_to(P, ahead.cov.shape)
    step = wrapped(later - wrapped(ahead.mean, periods), periods)
    back = smooth_step(P, ahead.cov, P @ np.swapaxes(F, -1, -2), step, cov, (F, Q))
    return Gaussian(wrapped(x + back.shift, periods), back.cov)
