"""Whether the returns that tracks of a recording took lie beside its truth, or are late."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Mapping, Sequence

import numpy as np

from vedette import Array, ImagingSensor, Scan, Sensor, Track, Tracker, Trajectory
from vedette_report.detector_errors.in_tracks import first_of, scans_at, taken
from vedette_report.detector_errors.off_truth import GROUPS, Beside, Returns, beside
from vedette_report.known import known
from vedette_report.recorded.tracks import Recorded


def beside_truth(
    tracker: Tracker,
    scans: Sequence[Scan],
    tracks: Sequence[Track],
    told: Sequence[Recorded],
    truth: Sequence[Trajectory],
    others: Collection[str] = (),
) -> Iterator[Beside]:
    """Yield each sensor whose returns lie beside the objects whose tracks took them, or are late.

    told: which track followed which object, and when. others: sensors of which it is known otherwise. A sensor that observes
    what the truth does not tell, as a velocity or an error of its own, is not asked.
    """
    scans = first_of(scans)
    at, by_id, paths = scans_at(scans), {track.id: track for track in tracks}, {path.name: path for path in truth}
    seen = defaultdict[str, list[Returns]](list)
    for one in told:
        if one.target is not None and one.truth in paths and one.track in by_id:
            for name, rows in _rows(tracker, scans, at, by_id[one.track], paths[one.truth], set(one.times.tolist())).items():
                apart, rates, noise = (np.array(each) for each in zip(*rows, strict=True))
                seen[name].append(Returns(apart, rates, noise, np.arange(len(rows)) * GROUPS // len(rows)))
    for name, parts in seen.items():
        if name not in others:
            found = beside(name, tracker.sensors[name].measurement, Returns.of(parts))
            if found is not None:
                yield found


def _rows(
    tracker: Tracker,
    scans: Sequence[Scan],
    at: Mapping[float, Sequence[int]],
    track: Track,
    path: Trajectory,
    times: set[float],
) -> dict[str, list[tuple[Array, Array, Array]]]:
    """Return by sensor of each return that a track took at `times` how far it is from the truth, its rate and its noise."""
    rows = defaultdict[str, list[tuple[Array, Array, Array]]](list)
    for row, i, column in taken(track, at):
        scan, sensor = scans[i], tracker.sensors[scans[i].sensor]
        if isinstance(sensor, ImagingSensor) or not set(sensor.observes.names) <= set(path.space.names):
            continue
        seen = scan.detections
        z, time = known(seen)[column], scan.time if seen.time is None else float(seen.time[column])
        x = path.at(time)
        if track.times[row] in times and x is not None and np.isfinite(z).all():
            where = path.space.locate(sensor.observes)
            placed = sensor.placed(scan.pose)
            noise = placed.noise(x[where]) if seen.noise is None else seen.noise[column]
            apart = placed.measurement.difference(z, placed.measure(x[where]))
            rows[scan.sensor].append((apart, _rate(placed, path, time), noise))
    return rows


def _rate(placed: Sensor, path: Trajectory, time: float) -> Array:
    """Return how fast what is measured of an object changes (m,), per s, over one step of its samples."""
    reach = 0.5 * float(np.median(np.diff(path.times))) if len(path.times) > 1 else 0.0
    before, after = np.clip([time - reach, time + reach], path.times[0], path.times[-1]).tolist()
    where = path.space.locate(placed.observes)
    (x, y), space = ((path.at(each) for each in (before, after)), placed.measurement)
    assert x is not None
    assert y is not None
    return space.difference(placed.measure(y[where]), placed.measure(x[where])) / max(after - before, 1e-12)
