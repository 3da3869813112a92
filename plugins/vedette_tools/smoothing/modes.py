"""Which agility each stretch of a path has: an interacting multiple model filter over densities of acceleration.

As in `linear`, one covariance serves all axes; what mixing adds to it, the spread of the modes' means, is their average.
Mode probabilities are smoothed as in Kim, Dynamic Linear Models with Markov-Switching, Journal of Econometrics 60, 1994.
"""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Mask
from vedette_tools.smoothing import compiled
from vedette_tools.smoothing.linear import ROUNDING
from vedette_tools.smoothing.paths import Paths

GATE = 30.0
"""A position that is off by this squared distance in every mode is gross: one in 3e6 is by chance."""

AGAIN = 4
"""So many gross positions in a row are none: the object is where they say."""

WIDE, RARE = 100.0, 1e-4
"""One report in 1 / RARE has an error of WIDE times the usual: so none counts for more than a certain amount."""

LEAST = 1e-30
"""A probability to divide by."""


@frozen(eq=False)
class Modes:
    """What a bank says of each row: the log-likelihood (n, s) of its report for each of s noises, the probabilities
    (n, s, m) of m modes by the reports until then, and those before its own; whether it is gross (n, s).
    """

    loglik: Array
    prob: Array
    prior: Array
    gross: Mask


def bank(
    paths: Paths, accels: Array, share: Array, switch: float, sigmas: Array, sigmas_velocity: Array, speed: Array
) -> Modes:
    """Return what modes of acceleration densities accels^2 (m,), m^2/s^3, say under each of the noises (s,), m and m/s.

    Between reports the mode changes with probability `switch`, to any in `share` (m,). speed (n,): as in `linear.smoothed`.
    """
    n, s, m, d = len(paths), len(sigmas), len(accels), paths.spots.shape[1]
    dt = paths.waits
    modes = Modes(np.zeros((n, s)), np.zeros((n, s, m), np.float32), np.zeros((n, s, m), np.float32), np.zeros((n, s), bool))
    density = accels**2
    if module := compiled.module(d, m):
        fixes = map(compiled.numbers, (dt, paths.spots, paths.velocities, speed))
        given = map(compiled.numbers, (density, share, sigmas**2, sigmas_velocity**2))
        module.bank(
            d, compiled.whole(paths.starts), *fixes, s, m, *given,
            switch, GATE, AGAIN, WIDE, RARE, ROUNDING, modes.loglik, modes.prob, modes.prior, modes.gross,
        )  # fmt: skip
        return modes
    noise, noise_pace = sigmas[:, None] ** 2, sigmas_velocity[:, None] ** 2
    paced: Mask = np.asarray(np.isfinite(paths.velocities).all(axis=-1))
    reported = np.nan_to_num(paths.velocities)
    for k, rows in paths.steps():
        b = len(rows)
        z = paths.spots[rows].T[:, :, None, None]
        if k == 0:
            x = np.broadcast_to(z, (d, b, s, m)).copy()
            v = np.zeros((d, b, s, m))
            p = np.broadcast_to(noise, (b, s, m)).copy()
            c, w = np.zeros((b, s, m)), np.broadcast_to((speed[rows] ** 2)[:, None, None], (b, s, m)).copy()
            mu = np.broadcast_to(share, (b, s, m)).copy()
            missed = np.zeros((b, s), dtype=int)
            modes.prior[rows] = mu
            like: Array = np.zeros((b, s, m))
        else:
            x, v, p, c, w, mu, missed = x[:, :b], v[:, :b], p[:b], c[:b], w[:b], mu[:b], missed[:b]
            # mixing: each mode goes on from itself, or from the mixture of all
            mean_x, mean_v = np.sum(mu * x, axis=-1, keepdims=True), np.sum(mu * v, axis=-1, keepdims=True)
            dx, dv = x - mean_x, v - mean_v
            all_p = np.sum(mu * (p + (dx * dx).sum(axis=0) / d), axis=-1, keepdims=True)
            all_c = np.sum(mu * (c + (dx * dv).sum(axis=0) / d), axis=-1, keepdims=True)
            all_w = np.sum(mu * (w + (dv * dv).sum(axis=0) / d), axis=-1, keepdims=True)
            prior = (1 - switch) * mu + switch * share
            f = switch * share / prior  # the part that comes from the mixture
            g = f * (1 - f)
            p = (1 - f) * p + f * all_p + g * (dx * dx).sum(axis=0) / d
            c = (1 - f) * c + f * all_c + g * (dx * dv).sum(axis=0) / d
            w = (1 - f) * w + f * all_w + g * (dv * dv).sum(axis=0) / d
            x, v = x - f * dx, v - f * dv
            h = dt[rows][:, None, None]
            x = x + h * v
            p, c, w = p + h * (2 * c + h * w) + density * h**3 / 3, c + h * w + density * h**2 / 2, w + density * h
            modes.prior[rows] = prior
            off = z - x
            S = p + noise
            d2 = (off * off).sum(axis=0) / S
            gross: Mask = np.asarray(d2.min(axis=-1) > GATE)
            missed = np.where(gross, missed + 1, 0)
            afresh = missed >= AGAIN
            modes.gross[rows] = gross
            like = log_density(d2, S, d)
            gain = np.where(gross, 0.0, 1.0)[..., None] / S
            x, v = x + gain * p * off, v + gain * c * off
            left = np.where(gross[..., None], 1.0, noise / S)
            p, c, w = p * left, c * left, np.maximum(w - gain * c * c, ROUNDING * w)
            if afresh.any():
                missed[afresh] = 0
                x[:, afresh] = np.broadcast_to(z, x.shape)[:, afresh]
                v[:, afresh], c[afresh] = 0.0, 0.0
                p[afresh] = np.broadcast_to(noise, p.shape)[afresh]
                w[afresh] = np.broadcast_to((speed[rows] ** 2)[:, None, None], w.shape)[afresh]
            mu = prior
        some = np.asarray(paced[rows])
        if some.any():
            off = reported[rows].T[:, :, None, None] - v
            S = w + noise_pace
            d2 = (off * off).sum(axis=0) / S
            used = np.where((d2.min(axis=-1) <= GATE) & some[:, None], 1.0, 0.0)[:, :, None]
            like = like + np.where(some[:, None, None], log_density(d2, S, d), 0.0)
            gain = used / S
            x, v = x + gain * c * off, v + gain * w * off
            left = np.where(used > 0, noise_pace / S, 1.0)
            p, c, w = np.maximum(p - gain * c * c, ROUNDING * p), c * left, w * left
        top = like.max(axis=-1, keepdims=True)
        joint = mu * np.exp(like - top)
        total = joint.sum(axis=-1, keepdims=True)
        mu = joint / total
        modes.loglik[rows] = (np.log(total) + top)[..., 0]
        modes.prob[rows] = mu
    return modes


def log_density(d2: Array, S: Array, d: int) -> Array:
    """Return the density along d axes at squared distances: Gaussian, but for one report in many whose error is larger."""
    far = np.log(RARE / WIDE**d) - 0.5 * d2 / WIDE**2
    density: Array = np.logaddexp(-0.5 * d2, far) - 0.5 * d * np.log(2 * np.pi * S)
    return density


def smoothed_modes(paths: Paths, prob: Array, prior: Array, share: Array, switch: float) -> Array:
    """Return the probabilities (n, m) of the modes by all reports, of those by the reports until each row."""
    after = prob.astype(float)
    if module := compiled.module(1, prob.shape[1]):
        earlier = map(compiled.numbers, (prior, share))
        module.smoothed_modes(prob.shape[1], compiled.whole(paths.starts), *earlier, switch, LEAST, after)
        return after
    ends = np.zeros(len(paths), dtype=bool)
    ends[paths.starts[1:][paths.lengths > 0] - 1] = True
    for _, rows in paths.steps(backwards=True):
        rows = rows[~ends[rows]]
        if len(rows):
            ratio = after[rows + 1] / np.maximum(prior[rows + 1], LEAST)
            back = after[rows] * ((1 - switch) * ratio + switch * (ratio @ share)[:, None])
            after[rows] = back / back.sum(axis=-1, keepdims=True)
    return after
