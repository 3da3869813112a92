"""The pairs of true objects and tracks that are near one another at one scan, and the best choice among such pairs.

A figure has a cut-off or a radius, and all that is farther apart counts the same. So the near pairs alone are kept: of a
thousand objects and a thousand tracks some thousand pairs instead of a million.
"""

from __future__ import annotations

from itertools import permutations
from typing import final

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.space import Array, Indices, Mask

_AT_ONCE = 2**21
"""Pairs whose distances are in memory at once while the near ones are sought."""
_ROUNDING = 1e-9
_SMALL = 2**14
"""Sizes of cost tables beyond which they are divided into parts that share no object and no track."""

_FEW = 4
"""Rows and columns of a table up to which all assignments are tried: a small run need not import scipy.optimize, .12 s."""


@final
@frozen(eq=False)
class Near:
    """Of `shape` (j, t) objects and tracks the pairs within a reach, by object, then by track.

    truth (q,) and track (q,) say which, as row and column; distance (q,) in m. All others are farther apart than the reach.
    """

    shape: tuple[int, int]
    truth: Indices
    track: Indices
    distance: Array

    def within(self, radius: float) -> Near:
        """Return the pairs that are at most `radius` m apart."""
        return self._only(self.distance <= radius)

    def among(self, truths: Mask | None = None, tracks: Mask | None = None) -> Near:
        """Return the pairs of some objects (j,) and some tracks (t,), numbered among these; default: of all."""
        rows = np.ones(self.shape[0], dtype=bool) if truths is None else truths
        columns = np.ones(self.shape[1], dtype=bool) if tracks is None else tracks
        left = self._only(rows[self.truth] & columns[self.track])
        row, column = np.cumsum(rows) - 1, np.cumsum(columns) - 1
        shape = (int(np.count_nonzero(rows)), int(np.count_nonzero(columns)))
        return Near(shape, row[left.truth], column[left.track], left.distance)

    def numbered(self, which: Indices, truths: int) -> Near:
        """Return the same pairs of the objects `which` (j,), ascending, among so many."""
        return Near((truths, self.shape[1]), which[self.truth], self.track, self.distance)

    @property
    def nearest(self) -> Array:
        """The distance of each track's nearest object (t,), infinite where none is within reach."""
        least = np.full(self.shape[1], np.inf)
        np.minimum.at(least, self.track, self.distance)
        return least

    def _only(self, some: Mask) -> Near:
        return self if some.all() else Near(self.shape, self.truth[some], self.track[some], self.distance[some])


def near(apart: Array | Near, radius: float = np.inf) -> Near:
    """Return the pairs at most `radius` m apart, of such pairs or of all distances (j, t); none at an infinite distance."""
    if isinstance(apart, Near):
        return apart.within(radius)
    truth, track = np.nonzero((apart <= radius) & (apart < np.inf))
    return Near((apart.shape[0], apart.shape[1]), truth, track, apart[truth, track])


def near_points(truth: Array, estimates: Array, reach: float, alive: Mask | None = None) -> Near:
    """Return the pairs of true objects (j, d), of those `alive` (j,), and estimates (t, d) that are at most `reach` m apart.

    Their distances are those of `distances`, bit for bit. It compares what is as near along the axis of the widest spread:
    with a reach of a part p of that spread some p j t pairs.
    """
    shape = (len(truth), len(estimates))
    rows = np.arange(shape[0]) if alive is None else np.flatnonzero(alive)
    if not len(rows) or not shape[1]:
        return Near(shape, np.zeros(0, dtype=np.intp), np.zeros(0, dtype=np.intp), np.zeros(0))
    axis = int(np.argmax(np.ptp(truth[rows], axis=0)))
    order = np.argsort(estimates[:, axis], kind="stable")
    line, place = estimates[order, axis], truth[rows, axis]
    margin = reach * (1.0 + _ROUNDING) + _ROUNDING * np.abs(place)  # no pair may be lost to the rounding of a difference
    begin, end = np.searchsorted(line, place - margin, "left"), np.searchsorted(line, place + margin, "right")
    parts = []
    blocks = np.cumsum(end - begin) // _AT_ONCE
    for block in np.split(np.arange(len(rows)), np.flatnonzero(np.diff(blocks)) + 1):
        count = (end - begin)[block]
        row = np.repeat(rows[block], count)
        column = order[kernels.counted(count, begin[block])]
        square = np.zeros(len(row))
        for d in range(truth.shape[1]):
            square += (truth[row, d] - estimates[column, d]) ** 2
        apart = np.sqrt(square)
        some = np.flatnonzero(apart <= reach)
        some = some[np.argsort(row[some] * shape[1] + column[some])]
        parts.append((row[some], column[some], apart[some]))
    row, column, apart = (np.concatenate([part[i] for part in parts]) for i in range(3))
    return Near(shape, row, column, apart)


def one_to_one(truth: Indices, track: Indices, cost: Array, without: float) -> Indices:
    """Return which of the pairs (q,) to take, ascending: one to one, at the least sum of their costs.

    An object or track without a pair costs nothing, a pair not taken `without`, more than any cost (q,) or as much; a pair
    that costs as much is not taken. Pairs that share nothing with others, and objects and tracks each of whose partners has
    no other, are settled without a search; the search grows with the cube of what hangs together.
    """
    some = np.flatnonzero(cost < without)
    if all(np.bincount(side[some], minlength=1).max() <= 1 for side in (truth, track)):
        return some  # the usual case: none has two partners
    taken = []
    for first, second in ((truth, track), (track, truth)):
        alone = np.bincount(second[some], minlength=1)[second[some]] == 1
        star = np.bincount(first[some], weights=~alone)[first[some]] == 0 if len(some) else alone
        rays = some[star]
        rays = rays[np.lexsort((rays, cost[rays], first[rays]))]
        taken.append(rays[np.diff(first[rays], prepend=-1) != 0])
        some = some[~star]
    taken += [part[_table(truth[part], track[part], cost[part], without)] for part in _parts(truth, track, some)]
    return np.sort(np.concatenate(taken))


def _parts(truth: Indices, track: Indices, some: Indices) -> list[Indices]:
    """Divide some pairs into those that hang together, if they are many."""
    if not len(some):
        return []
    rows, row = np.unique(truth[some], return_inverse=True)
    columns, column = np.unique(track[some], return_inverse=True)
    if len(rows) * len(columns) <= _SMALL:
        return [some]
    label = kernels.linked_clusters(row, column, len(rows), len(columns))[row]
    order = np.argsort(label, kind="stable")
    return np.split(some[order], np.flatnonzero(np.diff(label[order])) + 1)


def _table(truth: Indices, track: Indices, cost: Array, without: float) -> Indices:
    """Return which pairs (q,) are best, by a table of all objects and tracks among them."""
    rows, row = np.unique(truth, return_inverse=True)
    columns, column = np.unique(track, return_inverse=True)
    table, pair = np.full((len(rows), len(columns)), without), np.full((len(rows), len(columns)), -1)
    table[row, column], pair[row, column] = cost, np.arange(len(cost))
    chosen: Indices = pair[_assigned(table)]
    return chosen[chosen >= 0]


def _assigned(table: Array) -> tuple[Indices, Indices]:
    """Return the rows and columns of the best assignment."""
    rows, columns = table.shape
    if max(rows, columns) > _FEW:
        from scipy.optimize import linear_sum_assignment

        return linear_sum_assignment(table)
    if rows > columns:
        return _assigned(table.T)[::-1]
    cells = table.tolist()
    best = min(permutations(range(columns), rows), key=lambda picked: sum(cells[i][j] for i, j in enumerate(picked)))
    return np.arange(rows), np.array(best, dtype=np.intp)
