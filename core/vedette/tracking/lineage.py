"""Which tracks begin beside others, and which end beside others, by the returns that their gates share."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices, Mask
from vedette.values import maker

MOST = 0.5
"""A return counts as a track's own if it is with a greater probability."""


@frozen(eq=False)
class Gates:
    """The tracks that met a scan and the returns in their gates: what `lineage` follows from.

    ids (t,) and confirmed (t,): the tracks before the scan; born: how many had begun. rows (r,): the track of each row, one
    or more of each; scores (r, 1+k): -inf outside a row's gate, or else returns (r, w): those in it, -1 for none. starts
    (j,): the returns at which tracks began; None: those of the tracks that come last.
    """

    ids: Indices
    confirmed: Mask
    born: int
    rows: Indices
    scores: Array | None
    returns: Indices | None
    starts: Indices | None


new_gates = maker(Gates)


@frozen(eq=False)
class Lineage:
    """Tracks that split and merged in a scan, by ids; docs/many-targets.md says when a track counts as either.

    splits (j, 2): a track that began, and one that it may have split from; merges (j, 2): a track that ended, and the one
    that it may have merged into.
    """

    splits: Indices
    merges: Indices


def lineage(gates: Gates, ids: Indices, born: int, weights: Array, returns: Indices | None) -> Lineage | None:
    """Return what split and merged in a scan after which tracks `ids` (t,) have the weights (t, 1+w) of their returns."""
    sure = gates.ids[gates.confirmed]
    if ids is gates.ids or not len(sure):
        return None
    tracks, held = _gated(gates, sure)
    starts = gates.starts
    if starts is None:
        last = slice(len(ids) - (born - gates.born), None)
        if weights.shape[-1] == 1:  # no return, so none of them started a track
            starts = np.zeros(0, dtype=np.intp)
        else:
            starts = np.argmax(weights[last, 1:], axis=-1) if returns is None else returns[last, 0]
    child = np.full(1 + max(np.max(starts, initial=-1), np.max(held, initial=-1)), -1)
    child[starts] = gates.born + np.arange(len(starts))
    splits = np.column_stack([child[held], tracks])[child[held] >= 0]
    ended, merges = sure[~_among(sure, ids)].tolist(), []
    takers = _takers(ids, weights, returns, sure) if ended else {}
    for gone in ended:
        others = [other for one in set(held[tracks == gone].tolist()) for other in takers.get(one, ())]
        if others:
            merges.append((gone, min(set(others), key=lambda other: (-others.count(other), other))))
    if not len(splits) and not merges:
        return None
    return Lineage(splits, np.array(merges, dtype=np.int64).reshape(-1, 2))


def _gated(gates: Gates, sure: Indices) -> tuple[Indices, Indices]:
    """Return pairs (p,) of a confirmed track and a return in its gate, each once."""
    rows = np.flatnonzero(_among(gates.rows, sure))
    if gates.returns is not None:
        row, column = np.nonzero(gates.returns[rows] >= 0)
        return gates.rows[rows[row]], gates.returns[rows[row], column]
    assert gates.scores is not None
    k = max(1, gates.scores.shape[-1] - 1)
    row, column = np.nonzero(np.isfinite(gates.scores[rows, 1:]))
    tracks, held = np.divmod(np.unique(gates.rows[rows[row]] * k + column), k)
    return tracks, held


def _takers(ids: Indices, weights: Array, returns: Indices | None, sure: Indices) -> dict[int, list[int]]:
    """Return the confirmed tracks that took each return."""
    row, column = np.nonzero(weights[:, 1:] > MOST)
    taken, takers = column if returns is None else returns[row, column], dict[int, list[int]]()
    known = _among(ids[row], sure)
    for one, track in zip(taken[known].tolist(), ids[row[known]].tolist(), strict=True):
        takers.setdefault(one, []).append(track)
    return takers


def _among(ids: Indices, some: Indices) -> Mask:
    """Return which ids (j,) are among some others, which ascend."""
    if not len(some):
        return np.zeros(len(ids), dtype=bool)
    return some[np.minimum(np.searchsorted(some, ids), len(some) - 1)] == ids
