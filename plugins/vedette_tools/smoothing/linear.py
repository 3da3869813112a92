"""Filter and smoother of positions that keep their velocity but for noise, all pieces side by side.

Along each axis x' = x + v dt, with a white acceleration of density q along all, and errors that are alike along all. So one
covariance of (x, v) serves all axes, and a step is written out in numbers. It is the Kalman filter,
and the smoother of Rauch, Tung, Striebel (Maximum Likelihood Estimates of Linear Dynamic Systems, AIAA Journal 3, 1965).
"""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices
from vedette_tools.smoothing import compiled
from vedette_tools.smoothing.paths import Paths

VAGUE = 1e12
"""m^2: the variance of a position before anything is known."""

ROUNDING = 1e-15
"""A variance keeps such a part of itself at least: what is left beyond is rounding."""


@frozen(eq=False)
class Estimates:
    """Of each row: position and velocity (n, d) in m and m/s, and the variances of either along an axis (n,)."""

    spots: Array
    velocities: Array
    spot_variances: Array
    velocity_variances: Array

    def only(self, rows: Indices) -> Estimates:
        """Return those of some rows."""
        return Estimates(self.spots[rows], self.velocities[rows], self.spot_variances[rows], self.velocity_variances[rows])


def smoothed(paths: Paths, accel: Array, sigma: Array, sigma_velocity: Array, speed: Array) -> Estimates:
    """Return what all reports of a piece say of each of its rows.

    Parameters
    ----------
    paths
        A row that is not `told` is estimated from the others.
    accel
        Of the row (n,): the root of the density of the acceleration since the row before, in m/s^1.5.
    sigma, sigma_velocity
        Of the row (n,): the deviation of its position along an axis, in m, and of its velocity, in m/s.
    speed
        Of the row (n,): the deviation of velocities along an axis before anything is known, in m/s.
    """
    n, dt, d = len(paths), paths.waits, paths.spots.shape[1]
    mean, cov = np.zeros((n, 2 * d)), np.zeros((n, 3))  # x, y, vx, vy; the covariance of position and velocity along an axis
    ahead = np.zeros((n, 3))
    where, pace = np.nan_to_num(paths.spots), np.nan_to_num(paths.velocities)
    noise = np.where(paths.told, sigma**2, np.inf)
    noise_pace = np.where(np.isfinite(paths.velocities).all(axis=-1) & paths.told, sigma_velocity**2, np.inf)
    density = accel**2
    if module := compiled.module(d):
        given = map(compiled.numbers, (dt, where, pace, speed, density, noise, noise_pace))
        module.smoothed(d, compiled.whole(paths.starts), *given, VAGUE, ROUNDING, mean, cov, ahead)
        return Estimates(mean[:, :d], mean[:, d:], cov[:, 0], cov[:, 2])
    for k, rows in paths.steps():
        if k == 0:
            x = np.concatenate([where[rows], np.zeros((len(rows), d))], axis=-1)
            p, c, w = np.full(len(rows), VAGUE), np.zeros(len(rows)), speed[rows] ** 2
        else:
            h, q, b = dt[rows], density[rows], len(rows)
            x, p, c, w = x[:b].copy(), p[:b], c[:b], w[:b]
            x[:, :d] += h[:, None] * x[:, d:]
            p = p + h * (2 * c + h * w) + q * h**3 / 3
            c, w = c + h * w + q * h**2 / 2, w + q * h
        ahead[rows, 0], ahead[rows, 1], ahead[rows, 2] = p, c, w
        gain = 1.0 / (p + noise[rows])
        off = where[rows] - x[:, :d]
        x[:, :d] += (gain * p)[:, None] * off
        x[:, d:] += (gain * c)[:, None] * off
        left = np.where(np.isinf(noise[rows]), 1.0, gain * np.minimum(noise[rows], 1e300))
        p, c, w = p * left, c * left, np.maximum(w - gain * c * c, ROUNDING * w)
        gain = 1.0 / (w + noise_pace[rows])
        off = pace[rows] - x[:, d:]
        x[:, :d] += (gain * c)[:, None] * off
        x[:, d:] += (gain * w)[:, None] * off
        left = np.where(np.isinf(noise_pace[rows]), 1.0, gain * np.minimum(noise_pace[rows], 1e300))
        p, c, w = np.maximum(p - gain * c * c, ROUNDING * p), c * left, w * left
        mean[rows], cov[rows, 0], cov[rows, 1], cov[rows, 2] = x, p, c, w
    last = paths.lengths
    ends = np.zeros(n, dtype=bool)
    ends[paths.starts[1:][last > 0] - 1] = True
    for _, rows in paths.steps(backwards=True):
        rows = rows[~ends[rows]]
        if len(rows):
            _back(mean, cov, ahead, rows, dt, d)
    return Estimates(mean[:, :d], mean[:, d:], cov[:, 0], cov[:, 2])


def _back(mean: Array, cov: Array, ahead: Array, rows: Indices, dt: Array, d: int) -> None:
    """Take what is known of the rows after `rows` back to these."""
    later = rows + 1
    h = dt[later]
    p, c, w = cov[rows].T
    a, b, e = ahead[later].T
    # G = P F' A^-1, with P F' = [[p + h c, c], [c + h w, w]]
    det = a * e - b * b
    det = np.where(det > 0, det, np.inf)
    up, low = p + h * c, c + h * w
    g00, g01 = (up * e - c * b) / det, (c * a - up * b) / det
    g10, g11 = (low * e - w * b) / det, (w * a - low * b) / det
    x = mean[rows]
    step = mean[later]
    step[:, :d] -= x[:, :d] + h[:, None] * x[:, d:]
    step[:, d:] -= x[:, d:]
    mean[rows, :d] += g00[:, None] * step[:, :d] + g01[:, None] * step[:, d:]
    mean[rows, d:] += g10[:, None] * step[:, :d] + g11[:, None] * step[:, d:]
    a, b, e = cov[later, 0] - a, cov[later, 1] - b, cov[later, 2] - e
    cov[rows, 0] = np.maximum(p + g00 * g00 * a + 2 * g00 * g01 * b + g01 * g01 * e, ROUNDING * p)
    cov[rows, 1] = c + g00 * g10 * a + (g00 * g11 + g01 * g10) * b + g01 * g11 * e
    cov[rows, 2] = np.maximum(w + g10 * g10 * a + 2 * g10 * g11 * b + g11 * g11 * e, ROUNDING * w)
