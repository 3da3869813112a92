"""Returns that come in turn, as reports of AIS or plots of a rotating antenna do: no scan is a look at all targets."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import log, pi, sqrt
from typing import Any

import numpy as np

from vedette.space import Array, Indices
from vedette_tools.drafting.chains import LEAST, Chain

MOST = 600
"""So many returns tell how large their errors are, and how targets move."""

ERRORS = tuple(float(part) for part in np.geomspace(1e-5, 0.2, 9))
"""The errors that are tried, in parts of the side of the area."""

SPEEDS, COURSES = (0.1, 1.0, 10.0, 100.0, 1000.0), (3.0, 30.0, 1000.0)
"""m/s: the speeds that are tried; s: how long a target keeps one."""

GROSS, PASSES = 30.0, 3
"""A return so many times as far off as is usual is gross; those beside one show once it is out. Chosen by hand."""

USUAL, LONG = 20.0, 5.0
"""A pause is longer than so many usual waits of an object, and so many times longer than one wait in twenty is."""

FAR = 25.0
"""Beyond such a squared distance a return is another target's."""


def in_turn(times: Array, spots: Sequence[Array]) -> list[Chain]:
    """Return the chains of returns whose scans, at times (s,), hold a few targets each; spots: of each scan (k, 2).

    Each chain has a Kalman filter; a return goes on with the chain that makes it likeliest, or begins one. Errors, speeds
    and how they change are those of greatest likelihood among those that are tried.
    """
    scan = np.repeat(np.arange(len(spots)), [len(places) for places in spots])
    every = np.concatenate(spots)
    few = slice(0, MOST)
    area = float(np.prod(np.maximum(np.ptp(every[few], axis=0), 1e-9)))
    part, speed, lasts = np.array(list(product(ERRORS, SPEEDS, COURSES))).T
    tried = np.stack([part * sqrt(area), speed, speed / np.sqrt(lasts)], axis=-1)
    _, likely = _followed(times[scan[few]], every[few], scan[few], tried, area)
    best = int(np.argmax(likely))
    (owner,), _ = _followed(times[scan], every, scan, tried[best : best + 1], area)
    return of_owners(times, spots, owner)


def of_owners(times: Array, spots: Sequence[Array], owner: Indices) -> list[Chain]:
    """Return a chain for each owner, a number of every return (n,) in order, of which it has enough; -1 owns none."""
    scan: Any = np.repeat(np.arange(len(spots)), [len(places) for places in spots])
    place: Any = np.concatenate([np.arange(len(places)) for places in spots]).astype(int)
    every = np.concatenate(spots)
    order = np.argsort(owner, kind="stable")
    pieces = np.split(order, np.flatnonzero(np.diff(owner[order])) + 1)
    reports = []
    for rows in pieces:
        once = steady(rows[np.diff(times[scan[rows]], prepend=-np.inf) > 0], times[scan], every)
        if len(once) >= LEAST and owner[once[0]] >= 0:
            reports.append(Chain(scan[once], place[once], times[scan[once]], every[once]))
    return reports


def without_gross(chain: Chain) -> Chain:
    """Return a chain without the returns that lie far from where those before and after point."""
    rows = steady(np.arange(len(chain.times)), chain.times, chain.spots)
    return Chain(chain.scans[rows], chain.returns[rows], chain.times[rows], chain.spots[rows])


def longest_waits(named: Sequence[Indices], at: Array | Indices) -> Array:
    """Return for each name that comes often how long it waited at the longest, but for pauses after which it is another's.

    named: of each scan, codes (k,), at (s,).
    """
    when = np.repeat(at, [len(codes) for codes in named])
    codes = np.concatenate(named)
    order = np.argsort(codes, kind="stable")
    of_names = np.split(when[order], np.flatnonzero(np.diff(codes[order])) + 1)
    firsts = np.cumsum([0, *map(len, of_names[:-1])])
    often = [each for each, i in zip(of_names, firsts, strict=True) if len(each) >= LEAST and codes[order[i]] >= 0]
    return np.array([_longest(np.diff(each)) for each in often], dtype=float)


def _longest(waits: Array | Indices) -> float:
    """Return the longest of an object's waits; a name that comes back after far longer is given again, as a storm's is."""
    return float(np.max(waits[waits <= max(USUAL * np.median(waits), LONG * np.quantile(waits, 0.95))]))


def steady(rows: Indices, times: Array, spots: Array) -> Indices:
    """Return the rows (s,) of one owner without those that lie far from where the returns before and after point.

    So do returns of another object that bear its name by mistake, and positions that are wrong.
    """
    for _ in range(PASSES):
        if len(rows) < LEAST:
            break
        t, z = times[rows], spots[rows]
        part = ((t[1:-1] - t[:-2]) / (t[2:] - t[:-2]))[:, None]
        off = np.linalg.norm(z[1:-1] - z[:-2] - part * (z[2:] - z[:-2]), axis=-1)
        around = np.maximum(np.append(off[1:], 0.0), np.insert(off[:-1], 0, 0.0))
        wrong = (off > GROSS * np.median(off) + 1e-9) & (off >= around)
        if not wrong.any():
            break
        rows = rows[np.concatenate([[True], ~wrong, [True]])]
    return rows


def _followed(times: Array, spots: Array, scan: Indices, tried: Array, area: float) -> tuple[Indices, Array]:
    """Return whose each return (c, n) is, and how likely all are (c,), for each error in m, speed in m/s and acceleration.

    `tried` holds these, (c, 3). Of n returns before it the next is of a target that gave k of them with probability
    k / (n + 1), and of a new one with 1 / (n + 1) (the Chinese restaurant process): else many chains that take turns
    would be as likely as one.
    """
    n, every = len(times), np.arange(len(tried))
    error, speed, accel = tried.T
    R, Q = (error**2)[:, None], (accel**2)[:, None]
    owner = np.zeros((len(tried), n), dtype=int)
    last, velocity = np.zeros((2, len(tried), n)), np.zeros((2, len(tried), n))
    P = np.zeros((3, len(tried), n))  # along either axis: the variances of place and velocity, between them the covariance
    then, looked = np.full((len(tried), n), times[0]), np.full((len(tried), n), -1)
    given, often = np.zeros((len(tried), n)), np.full((len(tried), n), -np.inf)  # how many returns, and the logarithm
    count, total, new = np.zeros(len(tried), dtype=int), np.zeros(len(tried)), -log(area)
    for i, (time, spot) in enumerate(zip(times.tolist(), spots[:, :, None, None], strict=True)):
        most = int(count.max()) + 1  # with one that has not begun, and is likely of none
        dt = time - then[:, :most]
        place, both, pace = P[:, :, :most]
        place = place + dt * (2.0 * both + dt * (pace + dt * Q / 3))
        S = place + R
        expected = last[:, :, :most] + velocity[:, :, :most] * dt
        apart = spot - expected
        distance = np.sum(apart**2, axis=0) / S
        likely = -0.5 * distance - np.log(S) - log(2 * pi) + often[:, :most]
        likely[(distance > FAR) | (looked[:, :most] == scan[i])] = -np.inf
        best = np.argmax(likely, axis=-1)
        begins = likely[every, best] < new
        best[begins] = count[begins]
        count[begins] += 1
        total += np.where(begins, new, likely[every, best])
        at = every, best
        step, q = dt[at], Q[:, 0]
        ahead, quick = both[at] + step * (pace[at] + step * q / 2), pace[at] + step * q
        gain, turn = place[at] / S[at], ahead / S[at]
        last[:, *at] = np.where(begins, spot[:, 0], expected[:, *at] + gain * apart[:, *at])
        velocity[:, *at] += np.where(begins, 0.0, turn * apart[:, *at])
        updated = (1 - gain) * place[at], (1 - gain) * ahead, quick - turn * ahead
        P[:, *at] = np.where(begins, (R[:, 0], np.zeros_like(error), speed**2), updated)
        owner[:, i], then[at], looked[at] = best, time, scan[i]
        given[at] += 1
        often[at] = np.log(given[at])
        total -= log(i + 1)
    return owner, total
