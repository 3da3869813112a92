"""How far the returns that a track took are from the path of the object that it followed."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence

import numpy as np
from attrs import frozen

from vedette import Array, ImagingSensor, Mask, Scan, Sensor, Space, Track, Tracker, Trajectory
from vedette_report.detector_errors.in_tracks import returned, taken
from vedette_report.detector_errors.off_truth import GROUPS, Returns


@frozen(eq=False)
class OffPath:
    """The returns of one sensor, and which (k,) are of a time of which truth has a sample: between two it is a guess."""

    sensor: str
    space: Space
    returns: Returns
    sampled: Mask


def off_path(
    tracker: Tracker,
    scans: Sequence[Scan],
    at: Mapping[float, Sequence[int]],
    track: Track,
    path: Trajectory,
    times: Collection[float],
) -> tuple[OffPath, ...]:
    """Return what a track took at some times, by sensor; at: as `scans_at`.

    A sensor that observes what the truth does not tell, as a velocity or an error of its own, is not asked.
    """
    rows = defaultdict[str, list[tuple[Array, Array, Array, float]]](list)
    for row, i, column in taken(track, at):
        scan, sensor = scans[i], tracker.sensors[scans[i].sensor]
        if isinstance(sensor, ImagingSensor) or not set(sensor.observes.names) <= set(path.space.names):
            continue
        seen, (time, z) = scan.detections, returned(scan, column)
        x = path.at(time)
        if track.times[row] in times and x is not None and np.isfinite(z).all():
            where = path.space.locate(sensor.observes)
            placed = sensor.placed(scan.pose)
            noise = placed.noise(x[where]) if seen.noise is None else seen.noise[column]
            apart = placed.measurement.difference(z, placed.measure(x[where]))
            rows[scan.sensor].append((apart, _rate(placed, path, time), noise, time))
    found = []
    for name, each in rows.items():
        apart, rates, noise, when = (np.array(part) for part in zip(*each, strict=True))
        groups = np.arange(len(each)) * GROUPS // len(each)
        sampled = np.isin(when, path.times)
        found.append(OffPath(name, tracker.sensors[name].measurement, Returns(apart, rates, noise, groups), sampled))
    return tuple(found)


def _rate(placed: Sensor, path: Trajectory, time: float) -> Array:
    """Return how fast what is measured of an object changes (m,), per s, over one step of its samples."""
    reach = 0.5 * float(np.median(np.diff(path.times))) if len(path.times) > 1 else 0.0
    before, after = np.clip([time - reach, time + reach], path.times[0], path.times[-1]).tolist()
    where = path.space.locate(placed.observes)
    (x, y), space = ((path.at(each) for each in (before, after)), placed.measurement)
    assert x is not None
    assert y is not None
    return space.difference(placed.measure(y[where]), placed.measure(x[where])) / max(after - before, 1e-12)
