"""OSPA(2): the OSPA distance between two sets of whole tracks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.metrics import Near, ospa
from vedette.space import Array, Indices, Mask
from vedette_standard.whole_tracks.near_in_scans import near_in_scans


def ospa2(
    apart: Sequence[Array | Near],
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
    `apart`: per scan the distances (j, t) in m, infinite for an object that is not there, or those of near pairs; `present`:
    which of the `tracks` its columns are; `alive` (s, j). Windows at the beginning are shorter. The cost grows with the
    pairs that are ever near, and with a window with its length, at each scan.
    Beard, Vo, Vo, A Solution for Large-Scale Multi-Object Tracking, IEEE T-SP 68, 2020.
    """
    scans = len(apart)
    ends = [scans] if window is None else range(1, scans + 1)
    begins = [0 if window is None else max(end - window, 0) for end in ends]
    spans = zip(begins, ends, strict=True)
    return float(np.mean([_within(apart[i:k], present[i:k], alive[i:k], tracks, cutoff, order) for i, k in spans]))


def _within(
    apart: Sequence[Array | Near], present: Sequence[Indices], alive: Mask, tracks: int, cutoff: float, order: float
) -> float:
    """Return the distance over all the scans given."""
    _, truth, track, distance = near_in_scans(apart, present, cutoff)
    pair, where = np.unique(truth * tracks + track, return_inverse=True)
    excess = np.bincount(where.reshape(-1), 1.0 - (distance / cutoff) ** order, len(pair))
    truth, track = pair // max(tracks, 1), pair % max(tracks, 1)
    there = np.bincount(np.concatenate([np.zeros(0), *present]).astype(np.intp), minlength=tracks)
    either = np.count_nonzero(alive, axis=0)[truth] + there[track] - _both(truth, track, present, alive)
    distance = cutoff * np.maximum(1.0 - excess / either, 0.0) ** (1 / order)
    whole = Near((alive.shape[1], tracks), truth, track, distance)
    return ospa(whole.among(np.any(alive, axis=0), there > 0), cutoff, order)


def _both(truth: Indices, track: Indices, present: Sequence[Indices], alive: Mask) -> Indices:
    """Return at how many scans both of each pair (q,) are there, by the runs of scans at which the track is."""
    scan = np.repeat(np.arange(len(present)), [len(columns) for columns in present])
    entry = np.concatenate([np.zeros(0, dtype=np.intp), *present]).astype(np.intp)
    order = np.lexsort((scan, entry))
    scan, entry = scan[order], entry[order]
    goes_on = (np.diff(scan) == 1) & (np.diff(entry) == 0)
    first, last = (
        np.flatnonzero(np.append(True, ~goes_on)[: len(scan)]),
        np.flatnonzero(np.append(~goes_on, True)[: len(scan)]),
    )
    runs = np.searchsorted(entry[first], [track, track + 1])
    count = runs[1] - runs[0]
    run = np.repeat(runs[0] - np.cumsum(count) + count, count) + np.arange(int(np.sum(count)))
    pair = np.repeat(np.arange(len(truth)), count)
    before = np.concatenate([np.zeros((1, alive.shape[1]), dtype=np.intp), np.cumsum(alive, axis=0)])
    together = before[scan[last[run]] + 1, truth[pair]] - before[scan[first[run]], truth[pair]]
    return np.bincount(pair, together, len(truth)).astype(np.intp)
