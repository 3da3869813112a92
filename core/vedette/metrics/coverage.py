"""Which track covers which true object, scan by scan, and the losses and identity switches that follow."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np

from vedette.metrics.near_pairs import Near, near, one_to_one
from vedette.space import Array, Indices

NONE = -1
"""The covering track of a true object that none covers."""


@final
class LastCover:
    """What the matching of scans hands to that of later ones: who covered each true object last, and whom each track did."""

    def __init__(self, truths: int) -> None:
        self.last = np.full(truths, NONE)
        self.owner: dict[int, int] = {}


def covering(
    distance: Sequence[Array | Near],
    present: Sequence[Indices],
    radius: float,
    held: LastCover | None = None,
    which: Indices | None = None,
) -> Indices:
    """Return the track that covers each true object at each scan, (s, j), NONE where none does.

    Per scan: `distance` (j, t) in m, infinite for an object that does not exist then, or those of near pairs; and which
    tracks its columns are, `present` (t,). Rows are the true objects `which` (j,) of all those in `held`, by default all. A
    track covers at most one object. First, an object keeps the track that covered it last, if that has covered no other
    since and is still within `radius` in m. Then as many as possible of the rest are paired within `radius`, at the least
    sum of distances. `held` says what was before, by default nothing, and afterwards what is now. This is the matching of
    the CLEAR measures: Bernardin, Stiefelhagen, Evaluating Multiple Object Tracking Performance, EURASIP J. Image and Video
    Processing, 2008.
    """
    held = LastCover(distance[0].shape[0] if distance else 0) if held is None else held
    every = np.arange(len(held.last)) if which is None else which
    last, owner = held.last[every], held.owner
    cover = np.full((len(distance), len(every)), NONE)
    for s, (apart, columns) in enumerate(zip(distance, present, strict=True)):
        pairs = near(apart, radius)
        rows, tracks = pairs.truth, columns[pairs.track]
        owned = np.array([owner.get(track, NONE) for track in tracks.tolist()], dtype=np.intp)
        keeps = (tracks == last[rows]) & (owned == every[rows])
        free = np.flatnonzero(~(np.isin(rows, rows[keeps]) | np.isin(tracks, tracks[keeps])))
        chosen = np.concatenate([np.flatnonzero(keeps), free[_nearest(pairs, free)]])
        cover[s, rows[chosen]] = last[rows[chosen]] = tracks[chosen]
        owner.update(zip(tracks[chosen].tolist(), every[rows[chosen]].tolist(), strict=True))
    held.last[every] = last
    return cover


def switches(cover: Indices) -> int:
    """Count how often the track (s,) that covers an object differs from the last one that did."""
    return int(np.count_nonzero(np.diff(cover[cover != NONE])))


def _nearest(pairs: Near, free: Indices) -> Indices:
    """Return one-to-one pairs among those `free`: as many as possible, then at the least sum of distances."""
    truth, track, apart = pairs.truth[free], pairs.track[free], pairs.distance[free]
    beyond = (1.0 + np.max(apart, initial=0.0)) * (1 + min(len(np.unique(truth)), len(np.unique(track))))
    return one_to_one(truth, track, apart, float(beyond))
