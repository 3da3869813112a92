"""Which agility each stretch of a path has: an interacting multiple model filter over densities of acceleration.

As in `linear`, one covariance serves all axes; what mixing adds to it, the spread of the modes' means, is their average.
Mode probabilities are smoothed as in Kim, Dynamic Linear Models with Markov-Switching, Journal of Econometrics 60, 1994.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices, Mask
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
    """What a bank says of each row: the log-likelihood (n,) of its report, the probabilities (n, m) of the modes by the
    reports until then, and those before its own; whether it is gross (n,).
    """

    loglik: Array
    prob: Array
    prior: Array
    gross: Mask


@frozen(eq=False)
class Stance:
    """What pieces are taken to be under: how common each mode is in them (p, m), the probability (p,) that the mode changes
    from one report to the next, to any by its share, and the deviations (p,) of positions, in m, and of velocities, in m/s.
    """

    share: Array
    switch: Array
    sigma: Array
    sigma_velocity: Array

    def of(self, pieces: Indices) -> Stance:
        """Return that of some pieces."""
        return Stance(self.share[pieces], self.switch[pieces], self.sigma[pieces], self.sigma_velocity[pieces])


def bank(paths: Paths, accels: Array, stance: Stance, speed: Array) -> Modes:
    """Return what modes of acceleration densities accels^2 (m,), m^2/s^3, say; speed (n,): as in `linear.smoothed`."""
    n, m, d = len(paths), len(accels), paths.spots.shape[1]
    dt = paths.waits
    modes = Modes(np.zeros(n), np.zeros((n, m), np.float32), np.zeros((n, m), np.float32), np.zeros(n, bool))
    density = accels**2
    if module := compiled.module(d, m):
        fixes = map(compiled.numbers, (dt, paths.spots, paths.velocities, speed))
        under = stance.share, stance.switch, stance.sigma**2, stance.sigma_velocity**2
        module.bank(
            d, compiled.whole(paths.starts), *fixes, m, *map(compiled.numbers, (density, *under)),
            GATE, AGAIN, WIDE, RARE, ROUNDING, modes.loglik, modes.prob, modes.prior, modes.gross,
        )  # fmt: skip
        return modes
    paced: Mask = np.asarray(np.isfinite(paths.velocities).all(axis=-1))
    reported, mu, missed = np.nan_to_num(paths.velocities), np.zeros((0, m)), np.zeros(0, dtype=int)
    for k, rows in paths.steps():
        b = len(rows)
        own = stance.of(paths.piece[rows])
        noise, noise_pace, switch = own.sigma[:, None] ** 2, own.sigma_velocity[:, None] ** 2, own.switch[:, None]
        z, some = paths.spots[rows].T[:, :, None], np.asarray(paced[rows])
        fresh = partial(Beliefs.at, z, noise, (speed[rows] ** 2)[:, None], (d, b, m))
        if k == 0:
            now, prior = fresh(), own.share
            like: Array = np.zeros((b, m))
            missed = np.zeros(b, dtype=int)
        else:
            now, mu, missed = now.first(b), mu[:b], missed[:b]
            prior = (1 - switch) * mu + switch * own.share
            now = now.mixed(mu, switch * own.share / np.where(prior > 0, prior, 1.0)).moved(dt[rows][:, None], density)
            off = z - now.x
            d2, S = now.surprise(off, noise)
            modes.gross[rows] = gross = d2.min(axis=-1) > GATE
            missed = np.where(gross, missed + 1, 0)
            like = log_density(d2, S, d)
            now = now.updated(off, noise, np.where(gross, 0.0, 1.0)[:, None])
            if (afresh := missed >= AGAIN).any():
                missed[afresh] = 0
                now = now.replaced(afresh, fresh())
        modes.prior[rows] = prior
        if some.any():
            off, of_pace = reported[rows].T[:, :, None] - now.v, now.turned
            d2, S = of_pace.surprise(off, noise_pace)
            used = np.where((d2.min(axis=-1) <= GATE) & some, 1.0, 0.0)[:, None]
            like = like + np.where(some[:, None], log_density(d2, S, d), 0.0)
            now = of_pace.updated(off, noise_pace, used).turned
        top = like.max(axis=-1, keepdims=True)
        joint = prior * np.exp(like - top)
        total = joint.sum(axis=-1, keepdims=True)
        mu = joint / total
        modes.loglik[rows] = (np.log(total) + top)[:, 0]
        modes.prob[rows] = mu
    return modes


@frozen(eq=False)
class Beliefs:
    """What b pieces are believed to be at in each mode: positions x and velocities v (d, b, m), and their variances p and w
    and covariances c (b, m), which are alike along all axes.
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
        """Return others where (b,) says so."""
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
        """Return them after reports that are off by so much from the positions, where used (b, 1) is 1 and not 0."""
        S = self.p + noise
        gain, left = used / S, np.where(used > 0, noise / S, 1.0)
        w = np.maximum(self.w - gain * self.c * self.c, ROUNDING * self.w)
        return Beliefs(self.x + gain * self.p * off, self.v + gain * self.c * off, self.p * left, self.c * left, w)


def log_density(d2: Array, S: Array, d: int) -> Array:
    """Return the density along d axes at squared distances: Gaussian, but for one report in many whose error is larger."""
    far = np.log(RARE / WIDE**d) - 0.5 * d2 / WIDE**2
    density: Array = np.logaddexp(-0.5 * d2, far) - 0.5 * d * np.log(2 * np.pi * S)
    return density


def smoothed_modes(paths: Paths, modes: Modes, stance: Stance) -> Array:
    """Return the probabilities (n, m) of the modes by all reports, of those that a bank says."""
    after = modes.prob.astype(float)
    if module := compiled.module(1, after.shape[1]):
        earlier = map(compiled.numbers, (modes.prior, stance.share, stance.switch))
        module.smoothed_modes(after.shape[1], compiled.whole(paths.starts), *earlier, LEAST, after)
        return after
    ends = np.zeros(len(paths), dtype=bool)
    ends[paths.starts[1:][paths.lengths > 0] - 1] = True
    for _, rows in paths.steps(backwards=True):
        rows = rows[~ends[rows]]
        if len(rows):
            own = stance.of(paths.piece[rows])
            switch, ratio = own.switch[:, None], after[rows + 1] / np.maximum(modes.prior[rows + 1], LEAST)
            back = after[rows] * ((1 - switch) * ratio + switch * (ratio * own.share).sum(axis=-1, keepdims=True))
            after[rows] = back / back.sum(axis=-1, keepdims=True)
    return after
