"""Which agility each stretch of a path has: an interacting multiple model filter over densities of acceleration.

As in `linear`, one covariance serves all axes; what mixing adds to it, the spread of the modes' means, is their average.
Mode probabilities are smoothed as in Kim, Dynamic Linear Models with Markov-Switching, Journal of Econometrics 60, 1994.
"""

from __future__ import annotations

from functools import partial

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
    reported, mu = np.nan_to_num(paths.velocities), np.zeros((0, s, m))
    for k, rows in paths.steps():
        b = len(rows)
        z, some = paths.spots[rows].T[:, :, None, None], np.asarray(paced[rows])
        fresh = partial(Beliefs.at, z, noise, (speed[rows] ** 2)[:, None, None], (d, b, s, m))
        if k == 0:
            now, prior = fresh(), np.broadcast_to(share, (b, s, m))
            like: Array = np.zeros((b, s, m))
            missed = np.zeros((b, s), dtype=int)
        else:
            now, mu, missed = now.first(b), mu[:b], missed[:b]
            prior = (1 - switch) * mu + switch * share
            now = now.mixed(mu, switch * share / prior).moved(dt[rows][:, None, None], density)
            off = z - now.x
            d2, S = now.surprise(off, noise)
            modes.gross[rows] = gross = d2.min(axis=-1) > GATE
            missed = np.where(gross, missed + 1, 0)
            like = log_density(d2, S, d)
            now = now.updated(off, noise, np.where(gross, 0.0, 1.0)[..., None])
            if (afresh := missed >= AGAIN).any():
                missed[afresh] = 0
                now = now.replaced(afresh, fresh())
        modes.prior[rows] = prior
        if some.any():
            off, of_pace = reported[rows].T[:, :, None, None] - now.v, now.turned
            d2, S = of_pace.surprise(off, noise_pace)
            used = np.where((d2.min(axis=-1) <= GATE) & some[:, None], 1.0, 0.0)[:, :, None]
            like = like + np.where(some[:, None, None], log_density(d2, S, d), 0.0)
            now = of_pace.updated(off, noise_pace, used).turned
        top = like.max(axis=-1, keepdims=True)
        joint = prior * np.exp(like - top)
        total = joint.sum(axis=-1, keepdims=True)
        mu = joint / total
        modes.loglik[rows] = (np.log(total) + top)[..., 0]
        modes.prob[rows] = mu
    return modes


@frozen(eq=False)
class Beliefs:
    """What b pieces are believed to be at under each noise and in each mode: positions x and velocities v (d, b, s, m), and
    their variances p and w and covariances c (b, s, m), which are alike along all axes.
    """

    x: Array
    v: Array
    p: Array
    c: Array
    w: Array

    @classmethod
    def at(cls, z: Array, noise: Array, fast: Array, shape: tuple[int, ...]) -> Beliefs:
        """Return what one report each says."""
        x, v = np.broadcast_to(z, shape), np.zeros(shape)
        return cls(x, v, np.broadcast_to(noise, shape[1:]), np.zeros(shape[1:]), np.broadcast_to(fast, shape[1:]))

    @property
    def turned(self) -> Beliefs:
        """The same with velocities in the place of positions."""
        return Beliefs(self.v, self.x, self.w, self.c, self.p)

    def first(self, b: int) -> Beliefs:
        """Return those of the first pieces."""
        return Beliefs(self.x[:, :b], self.v[:, :b], self.p[:b], self.c[:b], self.w[:b])

    def replaced(self, where: Mask, by: Beliefs) -> Beliefs:
        """Return others where (b, s) says so."""
        pairs = zip((by.x, by.v, by.p, by.c, by.w), (self.x, self.v, self.p, self.c, self.w), strict=True)
        return Beliefs(*(np.where(where[..., None], other, own) for other, own in pairs))

    def mixed(self, mu: Array, f: Array) -> Beliefs:
        """Return each mode going on from itself, or by a part f from the mixture of all, of probabilities mu."""
        d, g = len(self.x), f * (1 - f)
        dx, dv = (part - np.sum(mu * part, axis=-1, keepdims=True) for part in (self.x, self.v))
        apart = ((one * other).sum(axis=0) for one, other in ((dx, dx), (dx, dv), (dv, dv)))
        p, c, w = (
            (1 - f) * own + f * np.sum(mu * (own + far / d), axis=-1, keepdims=True) + g * far / d
            for own, far in zip((self.p, self.c, self.w), apart, strict=True)
        )
        return Beliefs(self.x - f * dx, self.v - f * dv, p, c, w)

    def moved(self, h: Array, density: Array) -> Beliefs:
        """Return them h s later, under white noise of acceleration."""
        p = self.p + h * (2 * self.c + h * self.w) + density * h**3 / 3
        return Beliefs(self.x + h * self.v, self.v, p, self.c + h * self.w + density * h**2 / 2, self.w + density * h)

    def surprise(self, off: Array, noise: Array) -> tuple[Array, Array]:
        """Return the squared distances of reports that are off by so much, and the variances that these are over."""
        S = self.p + noise
        return (off * off).sum(axis=0) / S, S

    def updated(self, off: Array, noise: Array, used: Array) -> Beliefs:
        """Return them after reports that are off by so much from the positions, where used (b, s, 1) is 1 and not 0."""
        S = self.p + noise
        gain, left = used / S, np.where(used > 0, noise / S, 1.0)
        w = np.maximum(self.w - gain * self.c * self.c, ROUNDING * self.w)
        return Beliefs(self.x + gain * self.p * off, self.v + gain * self.c * off, self.p * left, self.c * left, w)


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
