"""Returns that follow one another as a target's do, found without knowing the noise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import astuple, evolve, frozen

from vedette.space import Array, Indices

START = 4.0
"""How far a target may move between its first two returns, in widths of the gate, if no more is told."""

CANDIDATES = 3
"""So many returns of the scan before may precede one."""

NEAR = 4
"""So many places near where a chain points are looked up at once; if others take all, every place is."""

COAST = 3
"""Misses in a row after which a chain ends."""

LEAST = 6
"""A chain of fewer returns may be chance."""


@frozen(eq=False)
class Chain:
    """One target's returns: which scan (s,) and which of its returns (s,), at `times` (s,) in s, `spots` (s, 2) in m."""

    scans: Indices
    returns: Indices
    times: Array
    spots: Array

    @property
    def looks(self) -> int:
        """The number of scans from the first to the last."""
        return int(self.scans[-1] - self.scans[0]) + 1


@frozen(eq=False)
class _Growing:
    """Chains that may go on, a row each: its number, how many returns it has, and how many scans it missed since the last,
    which was at time (c,) and spot (c, 2), with a velocity (c, 2).
    """

    number: Indices
    count: Indices
    missed: Indices
    time: Array
    spot: Array
    velocity: Array

    @classmethod
    def begun(cls, first: int, time: float, spot: Array, velocity: Array) -> _Growing:
        """Return chains of two returns, with numbers from `first` on."""
        c = len(spot)
        return cls(np.arange(first, first + c), np.full(c, 2), np.zeros(c, int), np.full(c, time), spot, velocity)

    def rows(self, chosen: Any) -> _Growing:
        return _Growing(*(value[chosen] for value in astuple(self, recurse=False)))

    def with_rows(self, other: _Growing) -> _Growing:
        both = zip(astuple(self, recurse=False), astuple(other, recurse=False), strict=True)
        return _Growing(*map(np.concatenate, both))


def unbroken(chain: Chain, width: float) -> list[Chain]:
    """Return a chain's pieces, cut where it jumps by more than `width` in m from where the two returns before point.

    So chains jump where they go over from one target to another, and a filter that followed would be told of violent motion.
    One return off the way is a piece of its own: it makes three jumps in a row, for it is the end, middle and start of one.
    """
    if len(chain.times) < 3:
        return [chain]
    dt, step = np.diff(chain.times), np.diff(chain.spots, axis=0)
    jumps = np.linalg.norm(step[1:] - step[:-1] * (dt[1:] / dt[:-1])[:, None], axis=-1) > width
    begun, ended = np.flatnonzero(np.diff(np.concatenate([[False], jumps, [False]]))).reshape(-1, 2).T
    cuts = np.sort(np.concatenate([begun + 2, ended[ended - begun == 3]]))
    pieces = np.split(np.arange(len(chain.times)), cuts)
    return [Chain(chain.scans[rows], chain.returns[rows], chain.times[rows], chain.spots[rows]) for rows in pieces]


def spacing(spots: Sequence[Array]) -> float:
    """Return half the usual distance between neighbouring returns of a scan, in m; inf where scans have one."""
    from scipy.spatial import KDTree

    nearest = [np.asarray(KDTree(places).query(places, 2)[0])[:, 1] for places in spots if len(places) > 1]
    if not nearest or sum(map(len, nearest)) < len(spots):
        return float("inf")
    return 0.5 * float(np.median(np.concatenate(nearest)))


def chains(times: Array, spots: Sequence[Array], width: float, reach: float = 0.0) -> list[Chain]:
    """Return the chains of returns that move steadily: each within `width` in m of where the two before it point.

    times (s,): of the scans; spots: of each scan, the positions (k, 2) of its returns; reach: how far a target may move
    between its first two returns, in m, if that is more than `START` tells. Longer chains choose first.
    """
    reach = max(reach, START * width)
    every, firsts = np.concatenate([np.empty((0, 2)), *spots]), np.cumsum([0, *map(len, spots)])
    growing = _Growing.begun(0, 0.0, np.empty((0, 2)), np.empty((0, 2)))
    members, ended, begun = [np.empty((2, 0), int)], [growing.number], 0
    before = np.empty(0, int)
    for i, time in enumerate(times.tolist()):
        now = np.arange(firsts[i], firsts[i + 1])
        growing = growing.rows(np.argsort(-growing.count, kind="stable"))
        found, growing = _gone_on(growing, time, every[now], width)
        hit = found >= 0
        members.append(np.stack([growing.number[hit], now[found[hit]]]))
        on = (growing.missed <= COAST) & ((growing.time == time) | (growing.count > 2))
        if not on.all():
            ended.append(growing.number[~on])
            growing = growing.rows(on)
        left = np.delete(now, found[hit])
        if len(before) and len(left) and (dt := time - float(times[i - 1])) > 0:
            first, second = _pairs(before, left, every, reach)
            new = _Growing.begun(begun, time, every[second], (every[second] - every[first]) / dt)
            members += [np.stack([new.number, first]), np.stack([new.number, second])]
            growing, begun = growing.with_rows(new), begun + len(first)
        before = left
    by_number = np.concatenate(members, axis=1)
    by_number = by_number[:, np.argsort(by_number[0], kind="stable")]
    numbers = np.concatenate([*ended, growing.number])  # those that ended first before others
    own = np.split(by_number[1], np.cumsum(np.bincount(by_number[0], minlength=1))[:-1])
    kept = _whole([own[number] for number in numbers.tolist() if len(own[number]) >= LEAST], firsts)
    return [Chain(scans, rows - firsts[scans], times[scans], every[rows]) for scans, rows in kept]


def _gone_on(growing: _Growing, time: float, places: Array, width: float) -> tuple[Indices, _Growing]:
    """Return which place (k, 2) each chain takes, -1 if none, and the chains after that; none takes two at one time."""
    expected, later = growing.spot + growing.velocity * (time - growing.time)[:, None], growing.time < time
    found = np.full(len(later), -1)
    found[later] = _free(expected[later], places, width)
    hit = found >= 0
    off = (places[found] if len(places) else expected) - expected
    dt = np.maximum(time - growing.time, 1e-9)
    gain = np.maximum(0.3, 2.0 / (growing.count + 1))[:, None]
    return found, evolve(
        growing,
        count=growing.count + hit,
        missed=np.where(hit, 0, growing.missed + later),
        time=np.where(hit, time, growing.time),
        spot=np.where(hit[:, None], expected + np.maximum(0.5, gain) * off, growing.spot),
        velocity=np.where(hit[:, None], growing.velocity + gain * off / dt[:, None], growing.velocity),
    )


def _free(expected: Array, places: Array, width: float) -> Indices:
    """Return which of places (k, 2) each of `expected` (c, 2) takes: the nearest within `width` that is free; -1: none."""
    found = np.full(len(expected), -1)
    apart, near = _nearest(expected, places, NEAR)
    free = np.ones(len(places), dtype=bool)
    for row in np.flatnonzero(np.any(apart <= width, axis=-1)).tolist():
        within = near[row, apart[row] <= width]
        left = within[free[within]]
        if not len(left) and len(within) == NEAR < len(places):
            every = np.where(free, np.linalg.norm(places - expected[row], axis=-1), np.inf)
            left = np.flatnonzero(free & (every == np.min(every)) & (every <= width))
        if len(left):
            found[row] = left[0]
            free[left[0]] = False
    return found


def _nearest(points: Array, places: Array, most: int) -> tuple[Array, Indices]:
    """Return how far the nearest of places (k, 2), at most so many, are from points (n, 2), and which these are."""
    from scipy.spatial import KDTree

    if len(places) > most and len(points):
        near = np.asarray(KDTree(places).query(points, np.arange(1, most + 1))[1])
    else:
        near = np.broadcast_to(np.arange(len(places))[:most], (len(points), min(len(places), most)))
    apart = np.linalg.norm(places[near] - points[:, None], axis=-1)
    order = np.lexsort((near, apart), axis=-1)
    row = np.arange(len(points))[:, None]
    return apart[row, order], near[row, order]


def _pairs(before: Indices, now: Indices, every: Array, reach: float) -> tuple[Indices, Indices]:
    """Return pairs of a return of the scan before and one of now that may be one target's; rows of `every` (n, 2)."""
    apart, near = _nearest(every[now], every[before], CANDIDATES)
    which, nth = np.nonzero(apart <= reach)
    return before[near[which, nth]], now[which]


def _whole(grown: Sequence[Indices], firsts: Indices) -> list[tuple[Indices, Indices]]:
    """Return the scans and returns of the chains that are long and dense enough, each return in one only.

    grown: the returns of each chain; those of a scan begin at `firsts`.
    """
    used = np.zeros(firsts[-1], dtype=bool)
    kept = []
    for chain in sorted(grown, key=len, reverse=True):
        rows = chain[~used[chain]]
        if len(rows) < max(LEAST, 0.8 * len(chain)):
            continue
        scans = np.searchsorted(firsts, rows, side="right") - 1
        if len(rows) >= 0.5 * (scans[-1] - scans[0] + 1):
            used[rows] = True
            kept.append((scans, rows))
    return kept
