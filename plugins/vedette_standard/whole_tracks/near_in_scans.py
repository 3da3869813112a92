"""Pairs of objects and tracks that are near each other, over all scans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.metrics import Near, near
from vedette.space import Array, Indices


def near_in_scans(
    apart: Sequence[Array | Near], present: Sequence[Indices], radius: float
) -> tuple[Indices, Indices, Indices, Array]:
    """Return scan, object, track and distance (q,) of the pairs at most `radius` m apart in all scans.

    `apart`: per scan, as in `near`; `present`: which tracks its columns are.
    """
    scans = [near(distance, radius) for distance in apart]
    none = np.zeros(0, dtype=np.intp)
    scan = np.repeat(np.arange(len(scans)), [len(pairs.truth) for pairs in scans])
    track = np.concatenate([none, *(columns[pairs.track] for pairs, columns in zip(scans, present, strict=True))])
    truth = np.concatenate([none, *(pairs.truth for pairs in scans)])
    return scan, truth, track.astype(np.intp), np.concatenate([np.zeros(0), *(pairs.distance for pairs in scans)])
