"""Whether a target gives several returns in a scan: beside those that tracks take lie others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from vedette import Array, Gaussian, Scan, Track, Tracker
from vedette_report.detector_errors.in_tracks import first_of, placed_in_plane, scans_at, taken

WITHIN = 9.0
"""Within this squared distance, by the noise of two, of a return that a track took others may be of its target."""
ENOUGH, SAMPLED = 50, 400
"""Taken returns of a sensor that tell it, at least, and so many of them are looked at, at most."""
PARTS, OFTEN = 4, 0.5
"""It is told where in each of so many parts of the time so many more lie there on average than in another scan: targets that
meet part again. By hand, on drawn cars.
"""


def several(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Iterator[str]:
    """Yield a sentence for each sensor whose targets give several returns a scan.

    What lies around the same place in a scan of another time is clutter, or what stands there.
    """
    scans = first_of(scans)
    at, took = scans_at(scans), dict[str, list[tuple[int, int]]]()
    for track in tracks:
        for row, i, column in taken(track, at):
            if track.confirmed[row] and scans[i].detections.identity is None:
                took.setdefault(scans[i].sensor, []).append((i, column))
    for name, every in took.items():
        some = sorted(every)[:: max(1, len(every) // SAMPLED)]
        placed = {i: placed_in_plane(tracker.sensors[name], scans[i]) for i, _ in some}
        near = []
        for (i, column), (j, _) in zip(some, _far(some), strict=True):
            if (here := placed[i]) is not None and (then := placed[j]) is not None:
                near.append((_beside(here, here, column) - 1, _beside(here, then, column)))
        if len(near) < ENOUGH:
            continue
        more, others = np.mean(near, axis=0)
        if min(np.mean(part[:, 0] - part[:, 1]) for part in np.array_split(np.array(near), PARTS)) > OFTEN:
            told = f"{name}: beside a return that a track takes lie {more:.1f} others of its scan within their noise"
            cure = "if these are of one object, make them one: preprocessor 'grouped_returns'; else that noise is too large"
            yield f"{told}, where in other scans {others:.1f} do: {cure}"


def _far(some: Sequence[tuple[int, int]]) -> Sequence[tuple[int, int]]:
    """Return another one for each, as far as may be in time."""
    half = len(some) // 2
    return [*some[half:], *some[:half]]


def _beside(here: Gaussian, then: Gaussian, column: int) -> int:
    """Return how many returns of a scan lie around the place of one return of a scan."""
    apart: Array = then.mean - here.mean[column]
    return int(np.sum(np.sum(apart * np.linalg.solve(2.0 * here.cov[column], apart.T).T, axis=-1) < WITHIN))
