"""Targets that the heaviest hypothesis of a cluster holds under one track, and others under another one."""

from __future__ import annotations

import numpy as np

from vedette import Array, Indices
from vedette.hypotheses import Hypotheses, firsts


def existence_by_substitutes(found: Hypotheses, own: Array, last: Indices, known: Array) -> Array:
    """Return existence (l,), `known` and more of leaves that each cluster's heaviest hypothesis holds, by the leaves' own.

    Another hypothesis without a leaf's track holds its target under a track which the heaviest lacks if the two took one of
    the same returns last (l, n), -1: none; or if they are linked so through tracks that both hold, which have then
    changed places. Each such track stands for one target, so no target exists by another one that was seen twice.
    """
    best, rows, track = firsts(found.cluster), found.rows, found.track
    held = found.leaves[best[rows]]
    of_track = np.full(int(np.max(track, initial=-1)) + 1, -1)
    of_track[track[held]] = held
    shared = of_track[track[found.leaves]] >= 0
    count = len(found.weights)
    size, common = np.diff(found.starts), np.bincount(rows[shared], minlength=count)
    asked = np.flatnonzero((common < size) & (common < size[best][found.cluster]))
    if not len(asked):
        return known
    total = found.existence(own, np.full((len(own), 1), -1) - 1 - np.arange(len(own))[:, None])
    start = found.starts[:-1][best][found.cluster]
    returns = [tuple(one for one in each if one >= 0) for each in last.tolist()]
    for h in asked.tolist():
        first = found.leaves[start[h] : start[h] + size[best][found.cluster[h]]].tolist()
        other = found.leaves[found.starts[h] : found.starts[h + 1]].tolist()
        for leaf, there in _substitutes(first, other, track, of_track, returns).items():
            total[leaf] += found.weights[h] * np.min(own[there])
    more: Array = np.minimum(np.maximum(known, total), 1.0)
    return more


def _substitutes(
    first: list[int], other: list[int], track: Indices, of_track: Indices, returns: list[tuple[int, ...]]
) -> dict[int, list[int]]:
    """Return the leaves of the other hypothesis by which it has the target of each leaf of the first one, if it has."""
    took: dict[int, list[int]] = {}
    for leaf in other:
        for one in returns[leaf]:
            took.setdefault(one, []).append(leaf)
    mine = {int(track[leaf]) for leaf in other}
    used, found = set[int](), dict[int, list[int]]()

    def path(leaf: int, seen: set[int]) -> list[int] | None:
        for one in reversed(returns[leaf]):
            for to in took.get(one, ()):
                if to in seen or to in used:
                    continue
                seen.add(to)
                beyond = int(of_track[track[to]])
                further = [] if beyond < 0 else path(beyond, seen)
                if further is not None:
                    return [to, *further]
        return None

    for leaf in first:
        if int(track[leaf]) not in mine and (there := path(leaf, set())) is not None:
            used.add(there[-1])
            found[leaf] = there
    return found
