"""Whether reports under one name are much likelier on the paths of two objects than on that of one."""

from __future__ import annotations

import numpy as np
from attrs import evolve

from vedette.space import Array, Indices, Mask
from vedette_tools.smoothing.modes import Stance, bank
from vedette_tools.smoothing.noises import ACCELS, SIGMAS, SWITCHES, copies
from vedette_tools.smoothing.paths import Paths, edges_of
from vedette_tools.smoothing.smoother import Smooth, speeds

WINDOW, MOST = 24, 12
"""Reports that are parted by two curves, parabolas in time, and so many times as many at most of each object."""

ROUNDS = 3
"""In which each report goes to the nearer curve, and each curve through its reports."""

SPLIT = 0.7
"""Such a part of the variance across a path lies between its two sides, at least, where it is looked at closer: 2 / pi of
Gaussian errors.
"""

SURE, A_ROW = 12.0, 0.15
"""By such a log-likelihood ratio, and so much for each report, two are believed: errors are not white. By hand, on recorded
ships and aircraft.
"""

LEAST = 8
"""So many gross errors may be a path."""


def two_chains(paths: Paths, smooth: Smooth, roundings: Array) -> Indices:
    """Return the objects whose reports are of two; roundings (o,): the deviation of positions in m by their digits.

    Of their longest piece, reports that are not gross are parted in two by curves, and those that are gross may be a path.
    """
    used = np.flatnonzero(paths.told)
    used = used[_of_longest(smooth.piece[used], smooth.objects)]
    far, used = used[smooth.gross[used]], used[~smooth.gross[used]]
    others = smooth.objects[smooth.piece[far]]
    found = [
        int(others[a])
        for a, k in zip(*_runs(others), strict=True)
        if _are_path(paths, smooth, far[a : a + k], roundings[others[a : a + 1]])
    ]
    whose = smooth.objects[smooth.piece[used]]
    first, count = _runs(whose)
    enough = count >= WINDOW
    first, many = first[enough], np.minimum(count[enough] // WINDOW, MOST)
    rows = np.concatenate([a + np.arange(k * WINDOW) for a, k in zip(first, many, strict=True)] or [np.zeros(0, int)])
    rows = used[rows].reshape(-1, WINDOW)
    of = np.repeat(np.arange(len(first)), many)
    X, side, split = _sides(paths.times[rows], paths.spots[rows])
    doubted = np.flatnonzero(np.bincount(of, split, len(first)) > SPLIT * many)
    for one in doubted.tolist():
        own = of == one
        labels = _parted(X[own], paths.spots[rows[own]], side[own] > 0)
        owner = int(whose[np.searchsorted(used, rows[own][0, 0])])
        if _are_two(paths, rows[own].ravel(), labels, roundings[[owner]]):
            found.append(owner)
    return np.unique(np.array(found, dtype=int))


def _of_longest(piece: Indices, objects: Indices) -> Mask:
    """Return which rows are of the longest piece of their object."""
    count = np.bincount(piece, minlength=len(objects))
    order = np.lexsort((-count, objects))
    longest = order[np.unique(objects[order], return_index=True)[1]]
    return np.isin(piece, longest)


def _runs(values: Indices) -> tuple[Indices, Indices]:
    """Return where runs of equal values begin, and how long they are."""
    edges = edges_of(values)
    return edges[:-1], np.diff(edges)


def _sides(times: Array, spots: Array) -> tuple[Array, Array, Array]:
    """Return of windows (k, w) the powers of time (k, w, 3), on which side of one curve each report lies, along the axis on
    which they lie farthest from it, and which part of their variance is between the sides.
    """
    u = times - times.mean(axis=1, keepdims=True)
    u = u / np.maximum(np.abs(u).max(axis=1, keepdims=True), 1e-9)
    X = np.stack([np.ones_like(u), u, u * u], axis=-1)
    x, y = np.moveaxis(spots - _fitted(X, spots, np.ones(u.shape)), -1, 0)
    angle = 0.5 * np.arctan2(2 * (x * y).mean(axis=1), (x * x - y * y).mean(axis=1))[:, None]
    side = x * np.cos(angle) + y * np.sin(angle)
    part, above = (side > 0).mean(axis=1), np.where(side > 0, side, 0.0).mean(axis=1)  # the mean of all is 0
    between = above**2 / np.maximum(part * (1 - part), 1e-9)
    return X, side, between / np.maximum((side * side).mean(axis=1), 1e-300)


def _fitted(X: Array, spots: Array, weights: Array) -> Array:
    """Return the curves (k, w, d) through weighted reports."""
    weighed = (X * weights[..., None]).swapaxes(1, 2)
    there: Array = X @ np.linalg.solve(weighed @ X + 1e-9 * np.eye(3), weighed @ spots)
    return there


def _parted(X: Array, spots: Array, second: Mask) -> Mask:
    """Return which reports of windows (k, w) lie on the second of two curves that go on from each window to the next."""
    for _ in range(ROUNDS):
        curves = [_fitted(X, spots, np.where(which, 1.0, 0.0)) for which in (~second, second)]
        off = [((spots - curve) ** 2).sum(axis=-1) for curve in curves]
        second = off[1] < off[0]
    before, after = (np.stack([curve[:, at] for curve in curves]) for at in (-1, 0))
    swapped = False
    for i in range(1, len(second)):
        kept, crossed = (np.linalg.norm(before[:, i - 1] - after[order, i], axis=-1).sum() for order in ([0, 1], [1, 0]))
        swapped = swapped != (crossed < kept)
        second[i] ^= swapped
    return second.ravel()


def _are_two(paths: Paths, rows: Indices, second: Mask, rounding: Array) -> bool:
    """Return whether rows are much likelier on two paths than on one: at its best noise each, by a bank of modes."""
    n, k = len(rows), int(second.sum())
    if min(k, n - k) < 3:
        return False
    one = _alone(paths, rows)
    both = one.only(np.argsort(second, kind="stable"), np.array([0, n - k, n]))
    speed = np.full(n, float(speeds(one)[0]))
    ratio = _loglik(both, speed, rounding) - _loglik(one, speed, rounding)
    ratio += k * np.log(k / n) + (n - k) * np.log((n - k) / n)
    ratio -= np.log(2 * np.pi * max(float(one.spots.var(axis=0).mean()), 1e-12))  # where the second begins
    return bool(ratio > SURE + A_ROW * n)


def _are_path(paths: Paths, smooth: Smooth, rows: Indices, rounding: Array) -> bool:
    """Return whether gross errors are much likelier on a path than each by itself, around the path of the others."""
    rows = rows[: WINDOW * MOST]
    n = len(rows)
    if n < LEAST:
        return False
    variance = float(((paths.spots[rows] - smooth.estimates.spots[rows]) ** 2).mean())
    path = _alone(paths, rows)
    ratio = _loglik(path, speeds(path), rounding) + (n - 1) * (np.log(2 * np.pi * variance) + 1.0)
    return bool(ratio > SURE + A_ROW * n)


def _alone(paths: Paths, rows: Indices) -> Paths:
    """Return rows as the positions of one path."""
    one = paths.only(rows, np.array([0, len(rows)]))
    return evolve(one, velocities=np.full_like(one.velocities, np.nan))


def _loglik(paths: Paths, speed: Array, rounding: Array) -> float:
    sigmas = np.unique(np.maximum(SIGMAS, rounding))
    pieces, noises, modes = len(paths.lengths), len(sigmas), len(ACCELS)
    again, rows, trial = copies(paths, np.zeros(pieces, dtype=int), np.zeros(noises, dtype=int))
    stance = Stance(np.full((noises, modes), 1 / modes), np.full(noises, SWITCHES[1]), sigmas, np.ones(noises))
    banked = bank(again, ACCELS, stance.of(trial), speed[rows])
    return float(np.bincount(np.repeat(trial, again.lengths), banked.loglik).max())
