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
    area = float(np.prod(np.maximum(np.ptp(every[few], axis=0), 1e-3)))
    tried = [(part * sqrt(area), speed, speed / sqrt(lasts)) for part, speed, lasts in product(ERRORS, SPEEDS, COURSES)]
    likely = [_followed(times[scan[few]], every[few], scan[few], *one, area)[1] for one in tried]
    owner, _ = _followed(times[scan], every, scan, *tried[int(np.argmax(likely))], area)
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


def longest_waits(named: Sequence[Indices]) -> Array:
    """Return for each name that comes often how many scans it waited at the longest; named: of each scan, codes (k,)."""
    scan = np.repeat(np.arange(len(named)), [len(codes) for codes in named])
    codes = np.concatenate(named)
    order = np.argsort(codes, kind="stable")
    of_names = np.split(scan[order], np.flatnonzero(np.diff(codes[order])) + 1)
    firsts = np.cumsum([0, *map(len, of_names[:-1])])
    often = [scans for scans, i in zip(of_names, firsts, strict=True) if len(scans) >= LEAST and codes[order[i]] >= 0]
    return np.array([np.max(np.diff(scans)) for scans in often], dtype=float)


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
        wrong = (off > GROSS * np.median(off) + 1e-6) & (off >= around)
        if not wrong.any():
            break
        rows = rows[np.concatenate([[True], ~wrong, [True]])]
    return rows


def _followed(
    times: Array, spots: Array, scan: Indices, error: float, speed: float, accel: float, area: float
) -> tuple[Indices, float]:
    """Return whose each return (n,) is, and how likely all are, with errors in m, speeds in m/s, an acceleration in m/s^2.

    Of n returns before it the next is of a target that gave k of them with probability k / (n + 1), and of a new one with
    1 / (n + 1) (the Chinese restaurant process): else many chains that take turns would be as likely as one.
    """
    owner = np.zeros(len(times), dtype=int)
    last, velocity = np.zeros((len(times), 2)), np.zeros((len(times), 2))
    P = np.zeros((3, len(times)))  # along either axis: the variances of place and velocity, and between them the covariance
    then, given, looked = np.zeros(len(times)), np.zeros(len(times)), np.full(len(times), -1)
    count, total, new = 0, 0.0, -log(area)
    for i, (time, spot) in enumerate(zip(times.tolist(), spots, strict=True)):
        dt = time - then[:count]
        place, both, pace = P[:, :count]
        place = place + dt * (2.0 * both + dt * (pace + dt * accel**2 / 3))
        S = place + error**2
        expected = last[:count] + velocity[:count] * dt[:, None]
        apart = spot - expected
        distance = np.sum(apart**2, axis=-1) / S
        likely = -0.5 * distance - np.log(S) - log(2 * pi) + np.log(given[:count])
        likely[(distance > FAR) | (looked[:count] == scan[i])] = -np.inf
        best = int(np.argmax(likely)) if count else -1
        if best < 0 or likely[best] < new:
            best, count, total = count, count + 1, total + new
            last[best], P[:, best] = spot, (error**2, 0.0, speed**2)
        else:
            total += float(likely[best])
            step = dt[best]
            ahead, quick = both[best] + step * (pace[best] + step * accel**2 / 2), pace[best] + step * accel**2
            gain, turn = place[best] / S[best], ahead / S[best]
            last[best], velocity[best] = expected[best] + gain * apart[best], velocity[best] + turn * apart[best]
            P[:, best] = (1 - gain) * place[best], (1 - gain) * ahead, quick - turn * ahead
        owner[i], then[best], looked[best] = best, time, scan[i]
        given[best] += 1
        total -= log(i + 1)
    return owner, total
