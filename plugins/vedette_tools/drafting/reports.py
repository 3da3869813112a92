"""Returns that come in turn, as reports of AIS or plots of a rotating antenna do: no scan is a look at all targets."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product
from math import log, pi
from typing import Any

import numpy as np

from vedette.space import Array, Indices
from vedette_tools.drafting.chains import LEAST, Chain

MOST = 1500
"""So many returns tell how fast targets move."""

PACES = tuple(float(pace) for pace in np.geomspace(0.03, 1000.0, 10))
"""m/s: how far, in each s, a return may lie from where its target was expected."""

WIDTHS = (0.1, 1.0, 10.0, 100.0)
"""The same at once, in s of the pace."""

GROSS, PASSES = 30.0, 3
"""A return so many times as far off as is usual is gross; those beside one show once it is out. Chosen by hand."""

FAR = 4.0
"""Beyond so many standard deviations a return is another target's."""


def in_turn(times: Array, spots: Sequence[Array]) -> list[Chain]:
    """Return the chains of returns whose scans, at times (s,), hold a few targets each; spots: of each scan (k, 2).

    A return goes on with the chain that makes it likeliest, or begins one. How far it may lie from where it was expected is
    that of greatest likelihood, of all returns, among those that are tried.
    """
    scan = np.repeat(np.arange(len(spots)), [len(places) for places in spots])
    every = np.concatenate(spots)
    few = slice(0, MOST)
    area = float(np.prod(np.maximum(np.ptp(every[few], axis=0), 1e-3)))
    tried = [(pace, width * pace) for pace, width in product(PACES, WIDTHS)]
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


def _followed(times: Array, spots: Array, scan: Indices, pace: float, width: float, area: float) -> tuple[Indices, float]:
    """Return whose each return (n,) is, and how likely all are if one is expected within `width` + `pace` dt, in m."""
    owner = np.zeros(len(times), dtype=int)
    last, velocity = np.zeros((len(times), 2)), np.zeros((len(times), 2))
    then, count, looked = np.zeros(len(times)), 0, np.full(len(times), -1)
    total, new = 0.0, -log(area)
    for i, (time, spot) in enumerate(zip(times.tolist(), spots, strict=True)):
        dt = time - then[:count]
        spread = width + pace * dt
        apart = np.linalg.norm(spot - last[:count] - velocity[:count] * dt[:, None], axis=-1) / spread
        likely = -0.5 * apart**2 - 2.0 * np.log(spread) - log(2 * pi)
        likely[(apart > FAR) | (looked[:count] == scan[i])] = -np.inf
        best = int(np.argmax(likely)) if count else -1
        if best < 0 or likely[best] < new:
            best, count, total = count, count + 1, total + new
            last[best] = spot
        else:
            total += float(likely[best])
            if dt[best] > 0:
                # The velocity forgets within some steps, so a turn is followed; it is 0 until two returns tell it.
                velocity[best] += 0.5 * ((spot - last[best]) / dt[best] - velocity[best])
            last[best] = spot
        owner[i], then[best], looked[best] = best, time, scan[i]
    return owner, total
