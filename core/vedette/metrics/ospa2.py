"""OSPA(2): the OSPA distance between two sets of whole tracks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.metrics.coverage import Indices
from vedette.metrics.gospa import ospa
from vedette.space import Array, Mask


def ospa2(
    apart: Sequence[Array],
    present: Sequence[Indices],
    alive: Mask,
    tracks: int,
    cutoff: float,
    order: float = 2.0,
    window: int | None = None,
) -> float:
    """Return OSPA(2) in m over the last `window` scans, the mean over the scans at which a window ends; default: over all.

    The distance of an object and a track is the mean, of order p, over the scans of the window at which either is there, of
    min(d, c), or c where only one of them is. OSPA compares the objects and tracks of the window by that distance.
    `apart`: per scan the distances (j, t) in m, infinite for an object that is not there; `present`: which of the `tracks`
    its columns are; `alive` (s, j). Windows at the beginning are shorter.
    Beard, Vo, Vo, A Solution for Large-Scale Multi-Object Tracking, IEEE T-SP 68, 2020.
    """
    scans = len(apart)
    ends = [scans] if window is None else range(1, scans + 1)
    begins = [0 if window is None else max(end - window, 0) for end in ends]
    spans = zip(begins, ends, strict=True)
    return float(np.mean([_within(apart[i:k], present[i:k], alive[i:k], tracks, cutoff, order) for i, k in spans]))


def _within(
    apart: Sequence[Array], present: Sequence[Indices], alive: Mask, tracks: int, cutoff: float, order: float
) -> float:
    """Return the distance over all the scans given."""
    excess, both = np.zeros((alive.shape[1], tracks)), np.zeros((alive.shape[1], tracks))
    there = np.zeros(tracks)
    for each, columns, now in zip(apart, present, alive, strict=True):
        rows = np.flatnonzero(now)
        block = np.ix_(rows, columns)
        excess[block] += 1.0 - np.minimum(each[rows] / cutoff, 1.0) ** order
        both[block] += 1.0
        there[columns] += 1.0
    known, named = np.flatnonzero(alive.any(axis=0)), np.flatnonzero(there)
    part = np.ix_(known, named)
    either = np.count_nonzero(alive[:, known], axis=0)[:, None] + there[named] - both[part]
    return ospa(cutoff * np.maximum(1.0 - excess[part] / either, 0.0) ** (1 / order), cutoff, order)
