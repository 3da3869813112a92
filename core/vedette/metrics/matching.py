"""Tracks and truth of one run matched scan by scan: the basis of all figures and pictures of errors."""

from __future__ import annotations

import numpy as np
from attrs import evolve, frozen

from vedette.metrics.consistency import nees
from vedette.metrics.coverage import NONE, LastCover, covering
from vedette.metrics.histories import Entries, Truth, positions
from vedette.metrics.near_pairs import Near, near_points
from vedette.metrics.score import Judge
from vedette.space import Array, Indices


@frozen(eq=False)
class MatchedPairs:
    """Covered objects and the entries of their tracks: scan (q,) of those judged, truth (q,), entry (q,), error (q, n).

    Of the position: square (q,), its squared error, and nees (q,), NaN in all if a covariance is singular.
    """

    scan: Indices
    truth: Indices
    entry: Indices
    error: Array
    square: Array
    nees: Array


@frozen(eq=False)
class Match:
    """Confirmed tracks, and the truth at the `s` judged scans.

    scans (s,): their indices; rows: per scan, which entries; apart: per scan, the pairs of objects and tracks within the
    largest distance that the options ask about; cover (s, j): the covering track of each, NONE where there is none.
    """

    entries: Entries
    truth: Truth
    scans: Indices
    rows: tuple[slice, ...]
    apart: tuple[Near, ...]
    cover: Indices

    @property
    def present(self) -> tuple[Indices, ...]:
        """Per scan, the tracks (t,) that exist."""
        return tuple(self.entries.track[rows] for rows in self.rows)

    def pairs(self) -> MatchedPairs:
        """Return the covered objects, by scan."""
        scan, truth = np.nonzero(self.cover != NONE)
        most = 1 + int(np.max(self.entries.track, initial=0))
        key = self.entries.scan * most + self.entries.track
        entry = np.searchsorted(key, self.scans[scan] * most + self.cover[scan, truth])
        error = self.truth.space.difference(self.entries.mean[entry], self.truth.states[scan, truth])
        spot = positions(self.truth.space)
        square, near = np.sum(error[:, spot] ** 2, axis=-1), self.entries.cov[entry][:, spot][:, :, spot]
        return MatchedPairs(scan, truth, entry, error, square, nees_or_nan(error[:, spot], near))


def nees_or_nan(error: Array, cov: Array) -> Array:
    """Return the NEES (q,), NaN if a covariance is singular."""
    try:
        return nees(error, cov)
    except ValueError:
        return np.full(len(error), np.nan)


def matched(entries: Entries, truth: Truth, judged: Indices, options: Judge, held: LastCover, which: Indices) -> Match:
    """Match the entries of confirmed tracks with the truth at the scans `judged`, the known offset removed.

    `held` says which matches there were before; `which` of its true objects are those of `truth`.
    """
    offset = dict(zip("xy", options.offset.tolist(), strict=True))
    entries = evolve(entries, mean=entries.mean - [offset.get(name, 0.0) for name in truth.space.names])
    where = positions(truth.space)
    if truth.unsaid.any():
        entries = _told(entries, truth, judged, options.cover_radius)
    begin, end = np.searchsorted(entries.scan, judged, "left"), np.searchsorted(entries.scan, judged, "right")
    rows = tuple(slice(i, j) for i, j in zip(begin.tolist(), end.tolist(), strict=True))
    place, spots = truth.states[..., where], entries.mean[:, where]
    asked = options.cover_radius, options.gospa_cutoff, options.far, options.near, options.lost_error
    reach = max(radius for radius in asked if radius is not None)  # what is farther apart counts as infinitely far
    scans = zip(place, rows, truth.alive, strict=True)
    every = tuple(near_points(there, spots[part], reach, alive) for there, part, alive in scans)
    present = tuple(entries.track[part] for part in rows)
    cover = covering(every, present, options.cover_radius, held, which)
    return Match(entries, truth, judged, rows, every, cover)


def _told(entries: Entries, truth: Truth, judged: Indices, radius: float) -> Entries:
    """Return the entries without those nearest to an object of which nothing is said, and covering no other."""
    where, told = positions(truth.space), np.ones(len(entries.scan), dtype=bool)
    for scan, alive, unsaid, states in zip(judged, truth.alive, truth.unsaid, truth.states[..., where], strict=True):
        rows = np.arange(*np.searchsorted(entries.scan, [scan, scan + 1])) if unsaid.any() else np.zeros(0, dtype=int)
        apart = np.linalg.norm(entries.mean[rows][:, None, where] - states, axis=-1)
        here, there = (np.min(apart[:, some], axis=-1, initial=np.inf) for some in (alive, unsaid))
        told[rows] = (here <= there) | (here <= radius)
    return entries.part(told, 0)
