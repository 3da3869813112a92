"""Which track covers which true object, scan by scan, and the losses and identity switches that follow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from vedette.space import Array, Mask

Indices = NDArray[np.integer[Any]]
NONE = -1
"""The covering track of a true object that none covers."""


@final
class Held:
    """What the matching of scans hands to that of later ones: who covered each true object last, and whom each track did."""

    def __init__(self, truths: int) -> None:
        self.last = np.full(truths, NONE)
        self.owner: dict[int, int] = {}


def covering(
    distance: Sequence[Array],
    present: Sequence[Indices],
    radius: float,
    held: Held | None = None,
    which: Indices | None = None,
) -> Indices:
    """Return the track that covers each true object at each scan, (s, j), NONE where none does.

    Per scan: `distance` (j, t) in m, infinite for an object that does not exist then, and which tracks its columns are,
    `present` (t,). Rows are the true objects `which` (j,) of all those in `held`, by default all. A track covers at most one
    object. First, an object keeps the track that covered it last, if that has covered no other since and is still within
    `radius` in m. Then as many as possible of the rest are paired within `radius`, at the least sum of distances. `held`
    says what was before, by default nothing, and afterwards what is now. This is the matching of the CLEAR measures:
    Bernardin, Stiefelhagen, Evaluating Multiple Object Tracking Performance, EURASIP J. Image and Video Processing, 2008.
    """
    held = Held(len(distance[0]) if distance else 0) if held is None else held
    every = np.arange(len(held.last)) if which is None else which
    last, owner = held.last[every], held.owner
    cover = np.full((len(distance), len(every)), NONE)
    for s, (apart, columns) in enumerate(zip(distance, present, strict=True)):
        if not columns.size or not every.size:
            continue
        within = apart <= radius
        owned = np.array([owner.get(column, NONE) for column in columns.tolist()])
        keeps = (columns[None, :] == last[:, None]) & (owned == every[:, None]) & within
        free = ~(keeps.any(axis=1)[:, None] | keeps.any(axis=0))
        chosen = keeps | _nearest(apart, within & free)
        rows, picked = np.nonzero(chosen)
        cover[s, rows] = last[rows] = columns[picked]
        owner.update(zip(columns[picked].tolist(), every[rows].tolist(), strict=True))
    held.last[every] = last
    return cover


def switches(cover: Indices) -> int:
    """Count how often the track (s,) that covers an object differs from the last one that did."""
    return int(np.count_nonzero(np.diff(cover[cover != NONE])))


def is_lost(covered: Mask, scans: int) -> bool:
    """Return whether an object was never covered in the scans of `covered` (s,), or later not for `scans` in a row."""
    found = np.flatnonzero(covered)
    return not found.size or int(np.max(np.diff(found, append=len(covered)))) > scans


def _nearest(apart: Array, allowed: Mask) -> Mask:
    """Return one-to-one pairs among those `allowed` (j, t): as many as possible, then at the least sum of distances."""
    from scipy.optimize import linear_sum_assignment

    chosen = np.zeros(allowed.shape, dtype=bool)
    if allowed.any():
        beyond = (1.0 + np.max(apart[allowed])) * (1 + min(allowed.shape))
        rows, columns = linear_sum_assignment(np.where(allowed, apart, beyond))
        chosen[rows, columns] = allowed[rows, columns]
    return chosen
