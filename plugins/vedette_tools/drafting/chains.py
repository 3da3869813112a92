"""Returns that follow one another as a target's do, found without knowing the noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import define, field, frozen

from vedette.space import Array

START = 4.0
"""How far a target may move between its first two returns, in widths of the gate."""

CANDIDATES = 3
"""So many returns of the scan before may precede one."""

COAST = 3
"""Misses in a row after which a chain ends."""

LEAST = 6
"""A chain of fewer returns may be chance."""


@frozen(eq=False)
class Chain:
    """One target's returns: which scan (s,) and which of its returns (s,), at `times` (s,) in s, `spots` (s, 2) in m."""

    scans: Array
    returns: Array
    times: Array
    spots: Array

    @property
    def looks(self) -> int:
        """The number of scans from the first to the last."""
        return int(self.scans[-1] - self.scans[0]) + 1


@define
class _Growing:
    members: list[tuple[int, int]]
    spot: Array
    velocity: Array
    time: float
    missed: int = field(default=0)


def unbroken(chain: Chain, width: float) -> list[Chain]:
    """Return a chain's pieces, cut where it jumps by more than `width` in m from where the two returns before point.

    So chains jump where they go over from one target to another, and a filter that followed would be told of violent motion.
    """
    if len(chain.times) < 3:
        return [chain]
    dt, step = np.diff(chain.times), np.diff(chain.spots, axis=0)
    jumps = np.linalg.norm(step[1:] - step[:-1] * (dt[1:] / dt[:-1])[:, None], axis=-1) > width
    first = jumps & ~np.concatenate([[False], jumps[:-1]])  # the step after a jump starts at its end, and is large as well
    pieces = np.split(np.arange(len(chain.times)), np.flatnonzero(first) + 2)
    return [Chain(chain.scans[own], chain.returns[own], chain.times[own], chain.spots[own]) for own in pieces]


def spacing(spots: Sequence[Array]) -> float:
    """Return half the usual distance between neighbouring returns of a scan, in m; inf where scans have one."""
    nearest = []
    for own in spots:
        if len(own) > 1:
            apart = np.linalg.norm(own[:, None] - own[None], axis=-1)
            np.fill_diagonal(apart, np.inf)
            nearest.append(apart.min(axis=1))
    if not nearest or sum(map(len, nearest)) < len(spots):
        return float("inf")
    return 0.5 * float(np.median(np.concatenate(nearest)))


def chains(times: Array, spots: Sequence[Array], width: float) -> list[Chain]:
    """Return the chains of returns that move steadily: each within `width` in m of where the two before it point.

    times (s,): of the scans; spots: of each scan, the positions (k, 2) of its returns. Longer chains choose first.
    """
    growing: list[_Growing] = []
    done: list[_Growing] = []
    before: list[tuple[int, int]] = []
    for i, (time, own) in enumerate(zip(times.tolist(), spots, strict=True)):
        free = np.ones(len(own), dtype=bool)
        kept: list[_Growing] = []
        for each in sorted(growing, key=lambda each: -len(each.members)):
            expected = each.spot + each.velocity * (time - each.time)
            apart = np.where(free, np.linalg.norm(own - expected, axis=-1), np.inf)
            j = int(np.argmin(apart)) if len(own) else -1
            if j >= 0 and apart[j] <= width:
                free[j] = False
                dt = max(time - each.time, 1e-9)
                gain = max(0.3, 2.0 / (len(each.members) + 1))
                each.velocity = each.velocity + gain * (own[j] - expected) / dt
                each.spot, each.time, each.missed = expected + max(0.5, gain) * (own[j] - expected), time, 0
                each.members.append((i, j))
            else:
                each.missed += 1
            (kept if each.missed <= COAST and (each.missed == 0 or len(each.members) > 2) else done).append(each)
        left = [(i, int(j)) for j in np.flatnonzero(free)]
        growing = [*kept, *_pairs(before, left, times, spots, START * width)]
        before = left
    return _whole([*done, *growing], times, spots)


def _pairs(
    before: list[tuple[int, int]], now: list[tuple[int, int]], times: Array, spots: Sequence[Array], reach: float
) -> list[_Growing]:
    """Return a chain for each return and each of its nearest in the scan before."""
    if not before or not now:
        return []
    first = np.array([spots[i][j] for i, j in before])
    found = []
    for i, j in now:
        apart = np.linalg.norm(first - spots[i][j], axis=-1)
        for k in np.argsort(apart)[:CANDIDATES]:
            dt = float(times[i] - times[before[k][0]])
            if apart[k] <= reach and dt > 0:
                velocity = (spots[i][j] - first[k]) / dt
                found.append(_Growing([before[k], (i, j)], spots[i][j], velocity, float(times[i])))
    return found


def _whole(found: list[_Growing], times: Array, spots: Sequence[Array]) -> list[Chain]:
    """Return the chains that are long and dense enough, each return in one only."""
    used: set[tuple[int, int]] = set()
    kept = []
    for each in sorted(found, key=lambda each: -len(each.members)):
        members = [member for member in each.members if member not in used]
        if len(members) < max(LEAST, 0.8 * len(each.members)):
            continue
        scans, returns = np.array(members).T
        if len(members) >= 0.5 * (scans[-1] - scans[0] + 1):
            used.update(members)
            kept.append(Chain(scans, returns, times[scans], np.array([spots[i][j] for i, j in members])))
    return kept
