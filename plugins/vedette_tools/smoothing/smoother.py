"""Paths from reports: cleaned, each with the noise and the agility that suit it, and smoothed."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices, Mask
from vedette_tools.smoothing import linear
from vedette_tools.smoothing.cleaning import gross
from vedette_tools.smoothing.modes import AGAIN, GATE, bank, log_density, smoothed_modes
from vedette_tools.smoothing.noises import Model, fitted, of_objects
from vedette_tools.smoothing.paths import Paths, windows

WINDOW, OVERLAP = 400, 50
"""Longer pieces are smoothed in windows of so many rows, with so many more on either side: what lies beyond is forgotten."""

SAMPLE, SAMPLE_ROWS = 200, 200
"""So many objects, and so many rows of each, tell the model."""

HELD_BACK, ENOUGH, MOST_FOLDS = 0.1, 200, 10
"""Part of a sample's reports by which its model is judged, and again with others until so many were, or so often."""

TELL = 3
"""So many reports of a piece tell errors from motion."""

MOST_GROSS = 0.5
"""If a larger part of a piece's reports is gross, none is: there is nothing that they are gross beside."""

SWELLS, DOUBTS = (0.5, 1.0, 2.0, 4.0), (1.0, 4.0, 16.0)
"""Factors of accelerations and of velocities' deviations that are tried on them."""


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
    """Return the model of the first objects of some paths; objects (p,): whose each piece is, in order.

    roundings (o,): the deviation of positions in m below which none of an object is taken to be, since digits are cut.

    Likelihood chooses noises and modes; as it takes errors to be white, which those of satellites' positions and of reported
    velocities are not, the agility and the trust in velocities are those by which reports held back are likeliest.
    """
    taken, whose = [], []
    lengths = [0]
    for one in range(min(int(objects.max(initial=-1)) + 1, SAMPLE)):
        left = SAMPLE_ROWS
        for piece in np.flatnonzero(objects == one).tolist():
            rows = np.arange(paths.starts[piece], min(paths.starts[piece + 1], paths.starts[piece] + left))
            rows = rows[paths.told[rows]]
            if len(rows):
                taken.append(rows)
                whose.append(one)
                lengths.append(len(rows))
                left -= len(rows)
    few = paths.only(np.concatenate(taken), np.cumsum(lengths))
    clean = few.without(gross(few))
    model, owner = fitted(clean, np.array(whose), speeds(clean), roundings[: whose[-1] + 1]), np.array(whose)
    paced = bool(np.isfinite(clean.velocities).any())
    trusts = [evolve(model, sigmas_velocity=model.sigmas_velocity * factor) for factor in (DOUBTS if paced else (1.0,))]
    folds = int(np.clip(np.ceil(ENOUGH / (HELD_BACK * len(clean))), 1, MOST_FOLDS))
    tenth = np.random.default_rng(0).permutation(len(clean)) % round(1 / HELD_BACK)
    back = (tenth == np.arange(folds)[:, None]).ravel()
    partly = evolve(_copies(clean, folds), told=~back)
    owners = np.concatenate([owner + i * (owner[-1] + 1) for i in range(folds)])
    cleaned, again = _Cleaned.of(partly), np.tile(roundings[: owner[-1] + 1], folds)
    likely = [_held_back(partly, back, _told(partly, owners, trust, cleaned, again)) for trust in trusts]
    trust, swell = np.unravel_index(int(np.argmax(likely)), (len(trusts), len(SWELLS)))
    return evolve(trusts[trust], swell=SWELLS[swell], told=bool(clean.lengths.max(initial=0) >= TELL))


def _copies(paths: Paths, count: int) -> Paths:
    """Return paths side by side with copies of themselves."""
    starts = np.concatenate([[0], *(paths.starts[1:] + i * len(paths) for i in range(count))])
    return paths.only(np.tile(np.arange(len(paths)), count), starts)


def _held_back(paths: Paths, back: Mask, told: Told) -> Array:
    """Return how likely reports are by the others with each of `SWELLS`: Gaussian, but for one in many of larger error.

    No piece is as long as a window.
    """
    count = len(SWELLS)
    accel = np.outer(SWELLS, told.accel).ravel()
    noises = (np.tile(each, count) for each in (told.sigma, told.sigma_velocity, told.speed))
    estimates = linear.smoothed(_copies(paths, count), accel, *noises)
    S = estimates.spot_variances.reshape(count, -1)[:, back] + told.sigma[back] ** 2
    off = paths.spots[back] - estimates.spots.reshape(count, *paths.spots.shape)[:, back]
    return np.asarray(np.sum(log_density((off**2).sum(axis=-1) / S, S, paths.spots.shape[1]), axis=-1))


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


@frozen(eq=False)
class Told:
    """What a path's own reports tell of each row: its acceleration, noises and first speed, as `linear.smoothed` takes them,
    which reports are gross, and where the object is all at once elsewhere.
    """

    accel: Array
    sigma: Array
    sigma_velocity: Array
    speed: Array
    gross: Mask
    jumps: Mask


def smoothed(paths: Paths, objects: Indices, model: Model, roundings: Array) -> Smooth:
    """Return the paths smoothed by a model; objects (p,): whose each piece is, in order; roundings (o,): as in `sampled`.

    Jumps begin further pieces.
    """
    told = _told(paths, objects, model, _Cleaned.of(paths), roundings)
    if told.jumps.any():
        starts = np.union1d(paths.starts, np.flatnonzero(told.jumps))
        objects = objects[np.searchsorted(paths.starts, starts[:-1], side="right") - 1]
        paths = evolve(paths, starts=starts)
    every = evolve(paths, told=_used(paths, told.gross))
    estimates = _over_windows(every, told, model)
    late = _outlying(every, estimates, told.sigma)
    if late.any():
        every = evolve(every, told=_used(paths, ~every.told | late))
        estimates = _over_windows(every, told, model)
    piece = paths.piece
    unknown = (np.bincount(piece, every.told, len(paths.lengths)) == 0)[piece]
    if unknown.any():
        for part in _parts(estimates):
            part[unknown] = np.nan
    return Smooth(estimates, paths.told & ~every.told, piece, objects)


def _used(paths: Paths, wrong: Mask) -> Mask:
    """Return which reports are used of those that are told, if some are wrong; all of a piece of which most are."""
    piece = paths.piece
    bad, all_told = (np.bincount(piece, paths.told & which, len(paths.lengths)) for which in (wrong, True))
    return paths.told & ~(wrong & (bad <= MOST_GROSS * all_told)[piece])


def _told(paths: Paths, objects: Indices, model: Model, cleaned: _Cleaned, roundings: Array) -> Told:
    rows, wrong = cleaned.rows, cleaned.wrong.copy()
    kept = np.flatnonzero(~wrong)
    accel, noise, off = _agility(cleaned.clean, cleaned.speed, objects, model, roundings)
    short, begun = _runs(off)
    wrong[kept] |= short
    bad, jumps = np.zeros((2, len(paths)), dtype=bool)
    bad[rows[wrong]] = True
    jumps[rows[kept][begun]] = True
    # What leads to a row is of the next clean report, its noises are of any of its object: the last piece has no later one.
    after = np.searchsorted(rows[kept], np.arange(len(paths)))
    whose = paths.piece
    last = np.searchsorted(rows[kept], paths.starts[1:])[whose] - 1
    after = np.maximum(np.minimum(after, last), 0)
    sigma = np.maximum(model.sigmas[noise][after], roundings[np.repeat(objects, paths.lengths)])
    return Told(accel[after], sigma, model.sigmas_velocity[noise][after], cleaned.speed[after], bad, jumps)


def _over_windows(paths: Paths, told: Told, model: Model) -> linear.Estimates:
    """Return the estimates of all rows; those of long pieces by windows."""
    again, rows, inner = windows(paths, WINDOW, OVERLAP)
    accel = model.swell * told.accel[rows]
    estimates = linear.smoothed(again, accel, told.sigma[rows], told.sigma_velocity[rows], told.speed[rows])
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


def _agility(paths: Paths, speed: Array, objects: Indices, model: Model, roundings: Array) -> tuple[Array, Indices, Mask]:
    """Return for each row the density's root of its acceleration, which noise its object has, and whether it is gross."""
    n = len(paths)
    again, rows, inner = windows(paths, WINDOW, OVERLAP)
    banked = bank(again, model.accels, model.share, model.switch, model.sigmas, model.sigmas_velocity, speed[rows])
    loglik = of_objects(_back(banked.loglik, rows, inner, n), paths, objects, roundings, model.sigmas)
    noise = np.argmax(loglik + np.log(model.common), axis=-1)[np.repeat(objects, paths.lengths)]
    pick = np.arange(len(rows)), noise[rows]
    prob = smoothed_modes(again, banked.prob[pick], banked.prior[pick], model.share, model.switch)
    accel = np.sqrt(_back(prob @ model.accels**2, rows, inner, n))
    off = np.zeros(n, dtype=bool)
    off[rows[inner]] = banked.gross[pick][inner]
    return accel, noise, off


def _runs(off: Mask) -> tuple[Mask, Mask]:
    """Return those that are off in a row of fewer than AGAIN, and where longer rows of them begin: there the object is."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], off.astype(int), [0]])))
    short, begun = off.copy(), np.zeros_like(off)
    for first, last in edges.reshape(-1, 2).tolist():
        if last - first >= AGAIN - 1:
            short[first:last] = False
            begun[first] = last - first >= AGAIN
    return short, begun
