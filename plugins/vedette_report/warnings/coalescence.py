"""Tracks that came to lie on each other: what averaging over associations does to targets that stay close."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

import numpy as np

from vedette import Array, Indices, Track

NEAR, LONG, SAMPLED = 0.5, 10, 400
"""Two tracks lie on each other within this part of the smaller one's standard deviation, in at least so many scans, of so
many that are looked at, at most. Chosen by hand.
"""
SHARED = 0.05
"""Only scans count of which both took a return with such a probability: what waits is unsure, and may lie anywhere."""
FEW = 100
"""So many tracks are compared pair by pair."""


def coalesced(tracks: Sequence[Track]) -> list[tuple[int, int, int]]:
    """Return the pairs of confirmed tracks that took returns and lay on each other, by ids, and in how many scans looked at.

    The standard deviation is the root of the trace of the position's covariance.
    """
    rows = [(track, np.flatnonzero(track.confirmed & (track.hit > SHARED))) for track in tracks]
    where = [i for i, axis in enumerate(tracks[0].space.axes) if axis.unit == "m"] if tracks else []
    if len(tracks) < 2 or not where:
        return []
    time = np.concatenate([track.times[scans] for track, scans in rows])
    ids = np.concatenate([np.full(len(scans), track.id) for track, scans in rows])
    at = np.concatenate([track.mean[scans][:, where] for track, scans in rows])
    sigma = np.sqrt(
        np.concatenate([np.trace(track.cov[scans][:, where][:, :, where], axis1=-2, axis2=-1) for track, scans in rows])
    )
    good = np.isfinite(at).all(axis=-1) & np.isfinite(sigma)
    times = np.unique(time)
    times = times[np.unique(np.linspace(0, len(times) - 1, SAMPLED).astype(int))] if len(times) > SAMPLED else times
    order = np.argsort(time, kind="stable")
    edges = np.searchsorted(time[order], times), np.searchsorted(time[order], times, side="right")
    met = Counter[tuple[int, int]]()
    for begin, end in zip(*edges, strict=True):
        scans = order[begin:end][good[order[begin:end]]]
        if len(scans) < 2:
            continue
        i, j = _pairs(at[scans], NEAR * float(np.median(sigma[scans])))
        a, b = scans[i], scans[j]
        near = np.linalg.norm(at[a] - at[b], axis=-1) < NEAR * np.minimum(sigma[a], sigma[b])
        near &= ids[a] != ids[b]  # two sensors may look at a time
        met.update(zip(np.minimum(ids[a], ids[b])[near].tolist(), np.maximum(ids[a], ids[b])[near].tolist(), strict=True))
    return [(*pair, number) for pair, number in met.items() if number >= LONG]


def _pairs(at: Array, reach: float) -> Iterable[Indices]:
    """Return the rows of pairs of positions (t, n) in m: all pairs of a few, of many those within `reach`."""
    if len(at) <= FEW:
        return np.triu_indices(len(at), 1)
    from scipy.spatial import KDTree  # takes an eighth of a small run's time to load

    return KDTree(at).query_pairs(reach, output_type="ndarray").T
