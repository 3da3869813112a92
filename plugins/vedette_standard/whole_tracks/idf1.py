"""How well identities are kept: the F1 of the best assignment of tracks to objects over a whole run."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.metrics import Near, one_to_one
from vedette.space import Array, Indices, Mask
from vedette_standard.whole_tracks.near_in_scans import near_in_scans


def idf1(apart: Sequence[Array | Near], present: Sequence[Indices], alive: Mask, radius: float) -> float | None:
    """Return 2 IDTP / (objects + tracks), both counted over the scans; None without either.

    IDTP are the scans in which an object and its track are at most `radius` apart, each object having one track over the
    whole run and each track one object, chosen so that there are as many as possible. `apart`: per scan the distances
    (j, t), or those of near pairs; `present`: which tracks the columns are; `alive` (s, j).
    Ristani, Solera, Zou, Cucchiara, Tomasi, Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking,
    ECCV Workshops 2016.
    """
    total = int(np.count_nonzero(alive)) + sum(map(len, present))
    if not total:
        return None
    _, truth, track, _ = near_in_scans(apart, present, radius)
    width = 1 + int(np.max(track, initial=0))
    pair, count = np.unique(truth * width + track, return_counts=True)
    best = one_to_one(pair // width, pair % width, -count.astype(float), 0.0)
    return 2.0 * float(np.sum(count[best])) / total
