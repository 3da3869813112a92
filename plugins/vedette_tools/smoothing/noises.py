"""What an object's own reports show of its errors and its agility, and what those of all show of errors."""

from __future__ import annotations

import numpy as np
from attrs import evolve, field, frozen

from vedette import kernels
from vedette.space import Array, Indices
from vedette_tools.smoothing import linear
from vedette_tools.smoothing.modes import Stance, bank, log_density, smoothed_modes
from vedette_tools.smoothing.paths import Paths

SIGMAS = np.geomspace(1e-3, 1e3, 25)
"""m: the deviations of positions along an axis that are tried."""

PACES = np.geomspace(0.03, 10.0, 6)
"""m/s: those of velocities."""

ACCELS = np.geomspace(1e-4, 100.0, 7)
"""m/s^1.5: the roots of densities of acceleration."""

SWITCHES = (0.02, 0.1, 0.3)
"""Probabilities that a mode changes from one report to the next."""

SWELLS, DOUBTS = (0.5, 1.0, 2.0, 4.0, 8.0), (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Factors of accelerations and of velocities' deviations that are tried on them."""

ROWS, BLOCKS = 200, 4
"""So many rows of an object tell them, in so many stretches."""

UNLIKELY = 8.0
"""A trial by e^this less likely than an object's best goes no further: the prior of 100 objects differs by e^7 at most."""

EVEN = 4.0
"""The prior of errors is as if so many objects beside those of a table had each as often as any other; of drawn fleets of
24, 1 instead changes no error by a hundredth.
"""

CALM = 2.0
"""So many reports, evenly of all modes, stand beside an object's own where shares of modes are counted: 7 is no better."""

ROUNDS = 30
"""Of expectation and maximisation."""

MOST = 1 << 17
"""Rows that are tried at once."""


@frozen(eq=False)
class Model:
    """What is known of objects before their reports are seen: how common each of `SIGMAS` is; and whether any has the three
    reports that tell errors from motion.
    """

    common: Array = field(factory=lambda: np.full(len(SIGMAS), 1 / len(SIGMAS)))
    told: bool = True

    @classmethod
    def of(cls, trials: Trials, told: bool) -> Model:
        """Return how common errors are among objects: of greatest likelihood beside `EVEN` objects with any."""
        model = cls(told=told)
        for _ in range(ROUNDS):
            shown = np.bincount(trials.error, trials.weights(model), len(SIGMAS))
            model = evolve(model, common=(shown + EVEN / len(SIGMAS)) / (shown.sum() + EVEN))
        return model


@frozen(eq=False)
class Trials:
    """What objects may be under, those of one object (t,) one after another: which of `SIGMAS` its error is, the stance, by
    which factor accelerations are larger than modes say, and how likely its reports are.
    """

    whose: Indices
    error: Indices
    stance: Stance
    swell: Array
    loglik: Array

    def of(self, some: Indices) -> Trials:
        """Return some of them."""
        return Trials(self.whose[some], self.error[some], self.stance.of(some), self.swell[some], self.loglik[some])

    def weights(self, model: Model) -> Array:
        """Return the probability of each among those of its object."""
        likely = self.loglik + np.log(model.common[self.error])
        likely = np.exp(likely - _of_objects(np.maximum, likely, self.whose))
        return np.asarray(likely / _of_objects(np.add, likely, self.whose))

    @property
    def best(self) -> Indices:
        """The likeliest of each object."""
        order = np.lexsort((-self.loglik, self.whose))
        return np.asarray(order[np.unique(self.whose[order], return_index=True)[1]])


def _of_objects(summed: np.ufunc, values: Array, whose: Indices) -> Array:
    """Return for each trial what those of its object come to together; every object has some."""
    return np.asarray(summed.reduceat(values, np.searchsorted(whose, np.arange(whose[-1] + 1)))[whose])


def copies(paths: Paths, objects: Indices, whose: Indices) -> tuple[Paths, Indices, Indices]:
    """Return the paths of objects (t,), one after another, of which row each is a copy, and which of these each piece is of.

    objects (p,): whose each piece is, in order.
    """
    first, last = (np.searchsorted(objects, whose, side=side) for side in ("left", "right"))
    pieces = kernels.counted(last - first, first)
    lengths = paths.lengths[pieces]
    rows = kernels.counted(lengths, paths.starts[pieces])
    return paths.only(rows, np.append(0, np.cumsum(lengths))), rows, np.repeat(np.arange(len(whose)), last - first)


@frozen(eq=False)
class Sample:
    """Some reports of each object: the paths, whose each piece is, in order, and the speed of each row by `speeds`."""

    paths: Paths
    objects: Indices
    speed: Array

    @classmethod
    def of(cls, paths: Paths, objects: Indices, speed: Array) -> Sample:
        """Return `ROWS` reports of each object at most, in `BLOCKS` stretches of its time."""
        whose = np.repeat(objects, paths.lengths)
        count = np.bincount(whose)
        rows = np.flatnonzero(kernels.counted(count) * BLOCKS % count[whose] < ROWS)
        begins = (np.diff(rows, prepend=-2) != 1) | (np.diff(paths.piece[rows], prepend=-1) != 0)
        starts = np.flatnonzero(begins)
        return cls(paths.only(rows, np.append(starts, len(rows))), whose[rows[starts]], speed[rows])

    @property
    def whose(self) -> Indices:
        """Whose each row is."""
        return np.repeat(self.objects, self.paths.lengths)

    def loglik(self, whose: Indices, stance: Stance) -> Array:
        """Return how likely the reports of objects (t,) are under stances."""
        rows = np.bincount(self.whose, minlength=int(whose[-1]) + 1)[whose]
        found = []
        for part in np.split(np.arange(len(whose)), np.flatnonzero(np.diff(np.cumsum(rows) // MOST)) + 1):
            again, of, trial = copies(self.paths, self.objects, whose[part])
            banked = bank(again, ACCELS, stance.of(part[trial]), self.speed[of])
            found.append(np.bincount(np.repeat(trial, again.lengths), banked.loglik, len(part)))
        return np.concatenate(found)

    def modes(self, stance: Stance) -> Array:
        """Return the probabilities of the modes of each row under the stances of the objects."""
        of_pieces = stance.of(self.objects)
        banked = bank(self.paths, ACCELS, of_pieces, self.speed)
        return smoothed_modes(self.paths, banked, of_pieces)


def fits(paths: Paths, objects: Indices, speed: Array, roundings: Array) -> Trials:
    """Return what objects may be under by their own reports; objects (p,): whose each piece is, in order.

    roundings (o,): the deviation of positions in m below which none of an object is taken to be, since digits are cut.
    """
    count, m = len(roundings), len(ACCELS)
    sample = Sample.of(paths, objects, speed)
    still = evolve(sample, paths=evolve(sample.paths, velocities=np.full_like(sample.paths.velocities, np.nan)))

    def trials(of: Sample, whose: Indices, error: Indices, pace: Array) -> Trials:
        t = len(whose)
        stance = Stance(np.full((t, m), 1 / m), np.full(t, SWITCHES[1]), np.maximum(SIGMAS[error], roundings[whose]), pace)
        all_of = Trials(whose, error, stance, np.ones(t), of.loglik(whose, stance))
        return all_of.of(np.flatnonzero(all_of.loglik > _of_objects(np.maximum, all_of.loglik, whose) - UNLIKELY))

    above = np.append(SIGMAS[1:], np.inf) > roundings[:, None]
    whose, error = np.nonzero(above)
    tried = trials(still, whose, error, np.ones(len(whose)))
    paced = np.bincount(sample.whose, np.isfinite(sample.paths.velocities).all(axis=-1), count) > 0
    if paced.any():
        times = np.where(paced, len(PACES), 1)[tried.whose]
        tried = trials(sample, np.repeat(tried.whose, times), np.repeat(tried.error, times), PACES[kernels.counted(times)])
    return _moving(sample, tried, np.where(paced, len(DOUBTS), 1))


def _moving(sample: Sample, trials: Trials, doubts: Indices) -> Trials:
    """Return trials with the modes, swell and trust in velocities that suit the best of each object.

    doubts (o,): how many of `DOUBTS` are tried.
    """
    m, every = len(ACCELS), np.arange(len(doubts))
    own = trials.of(trials.best).stance
    for _ in range(2):
        shown = np.zeros((len(every), m))
        np.add.at(shown, sample.whose, sample.modes(own))
        own = evolve(own, share=(shown + CALM / m) / (shown.sum(axis=-1, keepdims=True) + CALM))
    several = np.repeat(every, len(SWITCHES))
    switches = evolve(own.of(several), switch=np.tile(SWITCHES, len(every)))
    own = evolve(own, switch=np.array(SWITCHES)[sample.loglik(several, switches).reshape(len(every), -1).argmax(axis=-1)])
    accel = np.sqrt(sample.modes(own) @ ACCELS**2)
    many = doubts * len(SWELLS)
    whose, which = np.repeat(every, many), kernels.counted(many)
    swell, doubt = np.array(SWELLS)[which % len(SWELLS)], np.array(DOUBTS)[which // len(SWELLS)]
    weight = _left_out(sample, whose, own, accel, swell, doubt)
    weight = np.exp(weight - _of_objects(np.maximum, weight, whose))
    weight /= _of_objects(np.add, weight, whose)
    swell, doubt = (np.exp(np.bincount(whose, weight * np.log(factor)))[trials.whose] for factor in (swell, doubt))
    stance = Stance(
        own.share[trials.whose], own.switch[trials.whose], trials.stance.sigma, trials.stance.sigma_velocity * doubt
    )
    return evolve(trials, stance=stance, swell=swell)


def _left_out(sample: Sample, whose: Indices, own: Stance, accel: Array, swell: Array, doubt: Array) -> Array:
    """Return how likely reports of objects (t,) are by the others: z - x without one has the variance r^2 / (r - p)."""
    again, rows, trial = copies(sample.paths, sample.objects, whose)
    of = np.repeat(trial, again.lengths)
    sigma, pace = own.sigma[whose][of], (own.sigma_velocity[whose] * doubt)[of]
    estimates = linear.smoothed(again, accel[rows] * swell[of], sigma, pace, sample.speed[rows])
    left = np.maximum(sigma**2 - estimates.spot_variances, 1e-6 * sigma**2)
    d2 = ((again.spots - estimates.spots) ** 2).sum(axis=-1) / left
    return np.asarray(np.bincount(of, log_density(d2, sigma**4 / left, again.spots.shape[1]), len(whose)), dtype=float)
