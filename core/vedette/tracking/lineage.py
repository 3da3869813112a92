"""Which tracks begin beside others, and which end beside others, by the returns that their gates share."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices
from vedette.tracking.state import Lineage, State

MOST = 0.5
"""A return counts as a track's own if it is with a greater probability."""


@frozen(eq=False)
class Gated:
    """Pairs (p,) of a track that was confirmed before a scan and a return in its gate: id, return, association weight."""

    ids: Indices
    returns: Indices
    weights: Array


def gated(before: State, scores: Array, weights: Array) -> Gated:
    """Return the pairs of a scan from the scores (t, 1+k), -inf outside the gates, and the weights (t, 1+k)."""
    rows = np.flatnonzero(before.confirmed)
    track, column = np.nonzero(np.isfinite(scores[rows, 1:]))
    track = rows[track]
    return Gated(before.ids[track], column, weights[track, 1 + column])


def recorded(before: State, after: State, starts: Indices, pairs: Gated) -> State:
    """Return the state after a scan with what split and merged in it; starts (j,): the returns at which tracks began."""
    splits, merges = _splits(before.born, starts, pairs), _merges(before, after, pairs)
    if not len(splits) and not len(merges):
        return after
    return evolve(after, lineage=Lineage(splits, merges))


def starts(before: State, after: State) -> Indices:
    """Return the returns (j,) at which the tracks began that come last in the state after a scan."""
    count = after.born - before.born
    if count == 0:
        return np.zeros(0, dtype=np.int64)
    if after.returns is not None:
        return after.returns[-count:, 0]
    first: Indices = np.argmax(after.weights[-count:, 1:], axis=-1)
    return first


def _splits(born: int, starts: Indices, pairs: Gated) -> Indices:
    """Return (j, 2): a track that began, and a confirmed one in whose gate its first return was."""
    child = np.full(1 + max(np.max(starts, initial=-1), np.max(pairs.returns, initial=-1)), -1)
    child[starts] = born + np.arange(len(starts))
    child = child[pairs.returns]
    own = child >= 0
    return np.column_stack([child[own], pairs.ids[own]])


def _merges(before: State, after: State, pairs: Gated) -> Indices:
    """Return (j, 2): a confirmed track that is there no more, and the one that took most of the returns in its gate."""
    ids = before.ids[before.confirmed]
    found = []
    for gone in ids[~_among(ids, after.ids)].tolist():
        shared = np.isin(pairs.returns, pairs.returns[pairs.ids == gone])
        takes = shared & (pairs.weights > MOST) & _among(pairs.ids, after.ids)
        if takes.any():
            others, which = np.unique(pairs.ids[takes], return_inverse=True)
            found.append((gone, int(others[np.argmax(np.bincount(which, pairs.weights[takes]))])))
    return np.array(found, dtype=np.int64).reshape(-1, 2)


def _among(ids: Indices, some: Indices) -> Indices:
    """Return which ids (j,) are among some others, which ascend."""
    if not len(some):
        return np.zeros(len(ids), dtype=bool)
    there: Indices = some[np.minimum(np.searchsorted(some, ids), len(some) - 1)] == ids
    return there
