"""Paths from reports: cleaned, each with the noise and the agility that its own reports show, and smoothed."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices, Mask
from vedette_tools.smoothing import linear
from vedette_tools.smoothing.cleaning import gross
from vedette_tools.smoothing.modes import AGAIN, GATE, bank, smoothed_modes
from vedette_tools.smoothing.noises import ACCELS, Model, Trials, copies, fits
from vedette_tools.smoothing.paths import Paths, windows

WINDOW, OVERLAP = 400, 50
"""Longer pieces are smoothed in windows of so many rows, with so many more on either side: what lies beyond is forgotten."""

OBJECTS = 200
"""So many objects tell how common errors are."""

TELL = 3
"""So many reports of a piece tell errors from motion."""

MOST_GROSS = 0.5
"""If a larger part of a piece's reports is gross, none is: there is nothing that they are gross beside."""

LEAST = 1e-3
"""Less probable trials are left out."""


@frozen(eq=False)
class Smooth:
    """Of each row: what it is estimated as, NaN where no report of its piece tells, whether its report is gross, and the
    number of its piece; objects (p,): whose each piece is.
    """

    estimates: linear.Estimates
    gross: Mask
    piece: Indices
    objects: Indices


def sampled(paths: Paths, objects: Indices, roundings: Array) -> Model:
    """Return how common errors are among the first objects of some paths; objects (p,): whose each piece is, in order.

    roundings (o,): the deviation of positions in m below which none of an object is taken to be, since digits are cut.
    """
    pieces = int(np.searchsorted(objects, OBJECTS))
    first = paths.only(np.arange(paths.starts[pieces]), paths.starts[: pieces + 1])
    cleaned = _Cleaned.of(first)
    trials = fits(cleaned.clean, objects[:pieces], cleaned.speed, roundings[:OBJECTS])
    return Model.of(trials, bool(cleaned.clean.lengths.max(initial=0) >= TELL))


def speeds(paths: Paths) -> Array:
    """Return, for each row, the deviation of the velocities of its piece along an axis before anything is known."""
    n = len(paths)
    piece = paths.piece
    dt = paths.waits
    step = np.linalg.norm(np.diff(paths.spots, axis=0, prepend=paths.spots[:1]), axis=-1)
    fast = np.where(dt > 0, step / np.where(dt > 0, dt, 1.0), 0.0)
    most = np.zeros(len(paths.lengths))
    total = np.bincount(piece, np.where(dt > 0, fast**2, 0.0), len(most))
    count = np.bincount(piece, dt > 0, len(most))
    every = total.sum() / max(count.sum(), 1)  # of a lone report nothing else is known
    most = np.sqrt(np.where(count > 0, total / np.maximum(count, 1), every))
    return np.maximum(most, 0.1)[piece] if n else np.zeros(0)


@frozen(eq=False)
class _Cleaned:
    """Reports before any model is known: the rows that tell, which of these are gross, the others as paths, their speeds."""

    rows: Indices
    wrong: Mask
    clean: Paths
    speed: Array

    @classmethod
    def of(cls, paths: Paths) -> _Cleaned:
        rows = np.flatnonzero(paths.told)
        reported = paths.only(rows, np.searchsorted(rows, paths.starts))
        wrong = gross(reported)
        clean = reported.without(wrong)
        return cls(rows, wrong, clean, speeds(clean))


def smoothed(paths: Paths, objects: Indices, model: Model, roundings: Array) -> Smooth:
    """Return the paths smoothed under each stance that an object's own reports leave likely, mixed by how likely these are.

    objects (p,): whose each piece is, in order; roundings (o,): as in `sampled`. What other objects show enters into these
    weights alone. Jumps begin further pieces.
    """
    cleaned = _Cleaned.of(paths)
    trials = fits(cleaned.clean, objects, cleaned.speed, roundings)
    best = np.zeros(len(trials.whose), dtype=bool)
    best[trials.best] = True
    few = np.flatnonzero(best | (trials.weights(model) > LEAST))
    trials, best = trials.of(few), best[few]
    under = _Under.of(paths, objects, cleaned, trials, best)
    rows, trial, jumps = under.rows, under.trial, under.jumps
    if jumps.any():
        starts = np.union1d(paths.starts, np.flatnonzero(jumps))
        objects = objects[np.searchsorted(paths.starts, starts[:-1], side="right") - 1]
        paths = evolve(paths, starts=starts)
    full = evolve(under.paths, starts=np.union1d(under.paths.starts, np.flatnonzero(jumps[rows])))
    every = evolve(full, told=_used(full, under.gross))
    estimates = _over_windows(every, under)
    late = _outlying(every, estimates, under.sigma)
    if late.any():
        every = evolve(every, told=_used(full, ~every.told | late))
        estimates = _over_windows(every, under)
    weight, n = trials.weights(model)[trial], len(paths)

    def mean(values: Array) -> Array:
        return np.stack([np.bincount(rows, weight * part, n) for part in values.reshape(len(rows), -1).T], axis=-1)

    spots, velocities = mean(estimates.spots), mean(estimates.velocities)
    variances = [
        mean(own + ((each - middle[rows]) ** 2).mean(axis=-1))[:, 0]
        for own, each, middle in (
            (estimates.spot_variances, estimates.spots, spots),
            (estimates.velocity_variances, estimates.velocities, velocities),
        )
    ]
    mixed = linear.Estimates(spots, velocities, *variances)
    piece = paths.piece
    wrong = mean((full.told & ~every.told).astype(float))[:, 0] > 0.5
    unknown = (np.bincount(piece, paths.told & ~wrong, len(paths.lengths)) == 0)[piece]
    for part in _parts(mixed):
        part[unknown] = np.nan
    return Smooth(mixed, wrong, piece, objects)


@frozen(eq=False)
class _Under:
    """Paths once for each trial: of which row each is a copy, and of which trial; its acceleration, noises and first speed
    as `linear.smoothed` takes them, and whether its report is gross. Of the rows of the paths themselves: where an object's
    likeliest trial has it all at once elsewhere.
    """

    paths: Paths
    rows: Indices
    trial: Indices
    accel: Array
    sigma: Array
    sigma_velocity: Array
    speed: Array
    gross: Mask
    jumps: Mask

    @classmethod
    def of(cls, paths: Paths, objects: Indices, cleaned: _Cleaned, trials: Trials, best: Mask) -> _Under:
        clean, kept = cleaned.clean, cleaned.rows[~cleaned.wrong]
        again, of, piece = copies(clean, objects, trials.whose)
        wide, rows, inner, whole = windows(again, WINDOW, OVERLAP)
        stance = trials.stance.of(piece[whole])
        banked = bank(wide, ACCELS, stance, cleaned.speed[of][rows])
        accel = np.sqrt(_back(smoothed_modes(wide, banked, stance) @ ACCELS**2, rows, inner, len(again)))
        short, begun = _runs(_back(banked.gross.astype(float), rows, inner, len(again)) > 0)
        full, source, trial = copies(paths, objects, trials.whose)
        owner, trial = np.repeat(piece, again.lengths), np.repeat(trial, full.lengths)
        # Rows of one trial lie as those of its object do, farther along.
        along = _begins(trial, len(trials.whose)) - paths.starts[np.searchsorted(objects, trials.whose)]
        wrong, jumps = np.zeros((2, len(paths)), dtype=bool)
        wrong[cleaned.rows[cleaned.wrong]] = True
        bad = wrong[source]
        bad[kept[of[short]] + along[owner[short]]] = True
        jumps[kept[of[begun & best[owner]]]] = True
        # What leads to a row is of the next clean report; a row after the last has none.
        after = np.searchsorted(kept, np.arange(len(paths)))
        last = np.searchsorted(kept, paths.starts[1:])[paths.piece] - 1
        after = np.maximum(np.minimum(after, last), 0)[source]
        along = _begins(owner, len(trials.whose)) - clean.starts[np.searchsorted(objects, trials.whose)]
        there = np.clip(after + along[trial], 0, max(len(again) - 1, 0))
        accel = (accel[there] if len(again) else np.ones(len(source))) * trials.swell[trial]
        speed = cleaned.speed[after] if len(clean) else np.ones(len(source))
        sigma, pace = trials.stance.sigma[trial], trials.stance.sigma_velocity[trial]
        return cls(full, source, trial, accel, sigma, pace, speed, bad, jumps)


def _begins(trial: Indices, count: int) -> Indices:
    """Return where the rows of each trial begin among those of all."""
    return np.searchsorted(trial, np.arange(count))


def _used(paths: Paths, wrong: Mask) -> Mask:
    """Return which reports are used of those that are told, if some are wrong; all of a piece of which most are."""
    piece = paths.piece
    bad, all_told = (np.bincount(piece, paths.told & which, len(paths.lengths)) for which in (wrong, True))
    return paths.told & ~(wrong & (bad <= MOST_GROSS * all_told)[piece])


def _over_windows(paths: Paths, under: _Under) -> linear.Estimates:
    """Return the estimates of all rows; those of long pieces by windows."""
    again, rows, inner, _ = windows(paths, WINDOW, OVERLAP)
    noises = (each[rows] for each in (under.accel, under.sigma, under.sigma_velocity, under.speed))
    estimates = linear.smoothed(again, *noises)
    return linear.Estimates(*(_back(part, rows, inner, len(paths)) for part in _parts(estimates)))


def _parts(estimates: linear.Estimates) -> tuple[Array, ...]:
    return estimates.spots, estimates.velocities, estimates.spot_variances, estimates.velocity_variances


def _back(values: Array, rows: Indices, inner: Mask, n: int) -> Array:
    whole = np.zeros((n, *values.shape[1:]), values.dtype)
    whole[rows[inner]] = values[inner]
    return whole


def _outlying(paths: Paths, estimates: linear.Estimates, sigma: Array) -> Mask:
    """Return which reports are gross beside what all others say: z - x without it has the variance r^2 / (r - p)."""
    left = sigma**2 - estimates.spot_variances
    off = ((paths.spots - estimates.spots) ** 2).sum(axis=-1)
    return np.asarray(paths.told & (left > 1e-6 * sigma**2) & (off > GATE * np.maximum(left, 1e-300)))


def _runs(off: Mask) -> tuple[Mask, Mask]:
    """Return those that are off in a row of fewer than AGAIN, and where longer rows of them begin: there the object is."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], off.astype(int), [0]])))
    short, begun = off.copy(), np.zeros_like(off)
    for first, last in edges.reshape(-1, 2).tolist():
        if last - first >= AGAIN - 1:
            short[first:last] = False
            begun[first] = last - first >= AGAIN
    return short, begun
