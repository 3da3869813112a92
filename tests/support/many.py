"""Random problems of several objects and tracks over several scans, as the metrics take them."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Mask
from vedette.metrics import distances


@frozen(eq=False)
class Problem:
    """Objects (s, j, 2) and tracks (s, t, 2) in m, NaN where they are not there."""

    truth: Array
    tracks: Array

    @property
    def alive(self) -> Mask:
        return ~np.isnan(self.truth[..., 0])

    @property
    def present(self) -> list[Array]:
        return [np.flatnonzero(~np.isnan(row[:, 0])) for row in self.tracks]

    @property
    def apart(self) -> list[Array]:
        return [
            np.where(alive[:, None], distances(np.nan_to_num(objects), rows[columns]), np.inf)
            for objects, alive, rows, columns in zip(self.truth, self.alive, self.tracks, self.present, strict=True)
        ]

    def distance(self, k: int, i: int, j: int) -> float | None:
        """Return how far object i is from track j at scan k; None where one is lacking."""
        found = float(np.linalg.norm(self.truth[k, i] - self.tracks[k, j]))
        return None if np.isnan(found) else found


def problem(seed: int, scans: int = 6, truths: int = 3, tracks: int = 4, spread: float = 1.0) -> Problem:
    """Draw objects 4 m apart, and tracks that begin and end, each near an object at a time and now and then near another."""
    rng = np.random.default_rng(seed)
    truth = 4.0 * rng.standard_normal((truths, 2)) + np.cumsum(rng.standard_normal((scans, truths, 2)), axis=0)
    owner = np.where(rng.random((scans, tracks)) < 0.2, -1, np.arange(tracks) % truths)
    for k in range(1, scans):
        owner[k] = np.where(rng.random(tracks) < 0.75, owner[k - 1], rng.integers(0, truths, tracks))
    found = truth[np.arange(scans)[:, None], owner] + spread * rng.standard_normal((scans, tracks, 2))
    for path, first in ((truth, 0.15), (found, 0.3)):
        path[rng.random(path.shape[:2]) < first] = np.nan
    return Problem(truth, found)
