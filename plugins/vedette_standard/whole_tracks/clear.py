"""The CLEAR measures of multiple object tracking."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.metrics import NONE, Near, near, switches
from vedette.space import Array, Indices, Mask


@frozen
class Clear:
    """MOTA, at most 1, and below 0 where there are more mistakes than objects; MOTP in m; None without objects, or pairs."""

    mota: float | None
    motp: float | None
    missed: int
    false: int
    switches: int


def clear_mot(
    apart: Sequence[Array | Near], present: Sequence[Indices], alive: Mask, cover: Indices, false: int | None = None
) -> Clear:
    """Return 1 - (missed + false + identity switches) / objects, each summed over the scans, and the mean covered distance.

    `apart`: per scan the distances (j, t) in m, or those of near pairs; `present`: which tracks the columns are; `alive` and
    `cover` (s, j): where objects are there, and the track that covers each as in `covering`, which is the matching of these
    measures. `false`: how many tracks are false, if not all that cover nothing.
    Bernardin, Stiefelhagen, Evaluating Multiple Object Tracking Performance, EURASIP J. Image and Video Processing, 2008.
    """
    covered = cover != NONE
    objects, matches = int(np.count_nonzero(alive)), int(np.count_nonzero(covered))
    changed = sum(switches(cover[:, j]) for j in range(cover.shape[1]))
    wrong = sum(map(len, present)) - matches if false is None else false
    total = 0.0
    for distances, columns, row in zip(apart, present, cover, strict=True):
        pairs = near(distances)
        total += float(np.sum(pairs.distance[columns[pairs.track] == row[pairs.truth]]))
    return Clear(
        mota=1.0 - (objects - matches + wrong + changed) / objects if objects else None,
        motp=total / matches if matches else None,
        missed=objects - matches,
        false=wrong,
        switches=changed,
    )
