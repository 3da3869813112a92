"""Returns that follow one another as a target's do, found without knowing the noise."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import define, field, frozen

from vedette.space import Array

START = 4.0
"""How far a target may move between its first two returns, in widths of the gate, if no more is told."""

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
    growing: list[_Growing] = []
    done: list[_Growing] = []
    before: list[tuple[int, int]] = []
    for i, (time, places) in enumerate(zip(times.tolist(), spots, strict=True)):
        free = np.ones(len(places), dtype=bool)
        kept: list[_Growing] = []
        for chain in sorted(growing, key=lambda chain: -len(chain.members)):
            expected = chain.spot + chain.velocity * (time - chain.time)
            apart = np.where(free, np.linalg.norm(places - expected, axis=-1), np.inf)
            j = int(np.argmin(apart)) if len(places) else -1
            if j >= 0 and apart[j] <= width:
                free[j] = False
                dt = max(time - chain.time, 1e-9)
                gain = max(0.3, 2.0 / (len(chain.members) + 1))
                chain.velocity = chain.velocity + gain * (places[j] - expected) / dt
                chain.spot, chain.time, chain.missed = expected + max(0.5, gain) * (places[j] - expected), time, 0
                chain.members.append((i, j))
            else:
                chain.missed += 1
            (kept if chain.missed <= COAST and (chain.missed == 0 or len(chain.members) > 2) else done).append(chain)
        left = [(i, int(j)) for j in np.flatnonzero(free)]
        growing = [*kept, *_pairs(before, left, times, spots, reach)]
        before = left
    return _whole([*done, *growing], times, spots)


def _pairs(
    before: list[tuple[int, int]], now: list[tuple[int, int]], times: Array, spots: Sequence[Array], reach: float
) -> list[_Growing]:
    """Return a chain for each return and each of its nearest in the scan before."""
    if not before or not now:
        return []
    first = np.array([spots[i][j] for i, j in before])
    begun = []
    for i, j in now:
        apart = np.linalg.norm(first - spots[i][j], axis=-1)
        for k in np.argsort(apart)[:CANDIDATES]:
            dt = float(times[i] - times[before[k][0]])
            if apart[k] <= reach and dt > 0:
                velocity = (spots[i][j] - first[k]) / dt
                begun.append(_Growing([before[k], (i, j)], spots[i][j], velocity, float(times[i])))
    return begun


def _whole(grown: list[_Growing], times: Array, spots: Sequence[Array]) -> list[Chain]:
    """Return the chains that are long and dense enough, each return in one only."""
    used: set[tuple[int, int]] = set()
    kept = []
    for chain in sorted(grown, key=lambda chain: -len(chain.members)):
        members = [member for member in chain.members if member not in used]
        if len(members) < max(LEAST, 0.8 * len(chain.members)):
            continue
        scans, returns = np.array(members).T
        if len(members) >= 0.5 * (scans[-1] - scans[0] + 1):
            used.update(members)
            kept.append(Chain(scans, returns, times[scans], np.array([spots[i][j] for i, j in members])))
    return kept
