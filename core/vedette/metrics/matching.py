"""Tracks and truth of one run matched scan by scan: the basis of all figures and pictures of errors."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import evolve, frozen

from vedette.metrics.coverage import NONE, Indices, covering
from vedette.metrics.gospa import distances
from vedette.metrics.histories import Entries, Truth, confirmed_entries, positions, truth_at
from vedette.metrics.kept import kept
from vedette.metrics.score import Judge
from vedette.space import Array
from vedette.types import Scan, Track, Trajectory


@frozen(eq=False)
class Pairs:
    """Covered objects and the entries of their tracks: scan (q,) of those judged, truth (q,), entry (q,), error (q, n)."""

    scan: Indices
    truth: Indices
    entry: Indices
    error: Array


@frozen(eq=False)
class Match:
    """The tracks that were ever confirmed, and the truth at the `s` judged scans.

    scans (s,): their indices; rows: per scan, which entries; apart: per scan, the distances (j, t) in m, infinite for a
    object that does not exist then; cover (s, j): the covering track of each, NONE where there is none.
    """

    tracks: tuple[Track, ...]
    entries: Entries
    truth: Truth
    scans: Indices
    rows: tuple[slice, ...]
    apart: Sequence[Array]
    cover: Indices

    @property
    def present(self) -> tuple[Indices, ...]:
        """Per scan, the tracks (t,) that exist."""
        return tuple(self.entries.track[rows] for rows in self.rows)

    def covered_within(self, radius: float) -> Indices:
        """Return `cover` with another radius in m."""
        return covering(self.apart, self.present, len(self.tracks), radius)

    def pairs(self) -> Pairs:
        """Return the covered objects, by scan."""
        scan, truth = np.nonzero(self.cover != NONE)
        key = self.entries.scan * len(self.tracks) + self.entries.track
        entry = np.searchsorted(key, self.scans[scan] * len(self.tracks) + self.cover[scan, truth])
        error = self.truth.space.difference(self.entries.mean[entry], self.truth.states[scan, truth])
        return Pairs(scan, truth, entry, error)


def match(tracks: Sequence[Track], truth: Sequence[Trajectory], scans: Sequence[Scan], options: Judge) -> Match:
    """Match tracks with the truth at the scans that the tracker took and the options choose, the known offset removed.

    Scans before any true object is recorded, or after the last one, say nothing about the tracks and are not judged.
    InputError where truth and tracks have no position axis in common, or a track has an entry when there is no scan.
    """
    confirmed = tuple(track for track in tracks if track.confirmed.any())
    times = np.array([scan.time for scan in scans])
    chosen = options.choose(scans)
    real = truth_at(truth, times[chosen], confirmed[0].space if confirmed else None, options.truth_gap)
    entries = confirmed_entries(confirmed, times, real.space)
    offset = dict(zip("xy", options.offset.tolist(), strict=True))
    entries = evolve(entries, mean=entries.mean - [offset.get(name, 0.0) for name in real.space.names])
    known = real.known
    judged, real = chosen[known], Truth(real.space, real.states[known], real.alive[known], real.unsaid[known])
    where = positions(real.space)
    begin, end = np.searchsorted(entries.scan, judged, "left"), np.searchsorted(entries.scan, judged, "right")
    rows = tuple(slice(i, j) for i, j in zip(begin.tolist(), end.tolist(), strict=True))
    place, spots = real.states[..., where], entries.mean[:, where]

    def apart(i: int) -> Array:
        return np.where(real.alive[i][:, None], distances(place[i], spots[rows[i]]), np.inf)

    every = kept(len(judged), apart, len(truth) * sum(part.stop - part.start for part in rows))
    found = Match(confirmed, entries, real, judged, rows, every, np.zeros((len(judged), len(truth)), dtype=np.intp))
    return evolve(found, cover=found.covered_within(options.cover_radius)) if len(judged) else found
