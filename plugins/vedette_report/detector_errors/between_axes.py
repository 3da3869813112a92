"""Whether a sensor's errors along two measured axes go together more or less than it states, found without truth."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np
from attrs import frozen

from vedette import Array, Scan, Space, Track, Tracker
from vedette_report.detector_errors.in_tracks import first_of, measured_axes, returned, scans_at, taken
from vedette_report.detector_errors.shape import STEADY, Measured, long_run, residuals

FEWEST = 100
"""Fewer returns tell too little: by hand."""
SURE, MATTERS = 5.0, 0.2
"""A correlation is told where it is so many of its deviations off what is stated, and so far. By hand: what motion may hide
in residuals, by `STEADY`, is less.
"""


@frozen
class Together:
    """By how much a sensor's errors along two axes are correlated, with the deviation of that, and by how much as stated."""

    sensor: str
    axes: tuple[str, str]
    correlation: float
    deviation: float
    stated: float
    returns: int

    def data(self) -> dict[str, object]:
        """Return the figures as plain data."""
        told = [self.correlation, self.deviation]
        return {"sensor": self.sensor, "axes": list(self.axes), "correlation": told, "stated": self.stated}

    def __str__(self) -> str:
        """Say what it looks like, and what to do."""
        size = f"{self.correlation:+.2f} +- {self.deviation:.1g}, stated {self.stated:.2g}"
        told = f"{self.sensor}: its errors along {' and '.join(self.axes)} are correlated by {size} ({self.returns} returns)"
        return f"{told}: R is to have it off its diagonal, else P is too small along one direction and too large across it"


def together(tracker: Tracker, scans: Sequence[Scan], tracks: Sequence[Track]) -> Iterator[Together]:
    """Yield each pair of a sensor's axes along which errors are correlated otherwise than stated.

    Of returns less the cubic through the two before and the two after, as in `shape_of`: it leaves out what moves smoothly.
    """
    scans = first_of(scans)
    at, axes = scans_at(scans), {name: measured_axes(sensor) for name, sensor in tracker.sensors.items()}
    seen = defaultdict[tuple[str, int], list[tuple[float, Array, Array]]](list)
    for track in tracks:
        for row, i, column in taken(track, at):
            sensor, detections = tracker.sensors[scans[i].sensor], scans[i].detections
            if len(axes[scans[i].sensor]) > 1 and track.confirmed[row]:
                x = track.mean[row, track.space.locate(sensor.observes)]
                R = sensor.placed(scans[i].pose).noise(x) if detections.noise is None else detections.noise[column]
                seen[scans[i].sensor, track.id].append((*returned(scans[i], column), R))
    for name, own in axes.items():
        paths = [Taken(*map(np.array, zip(*rows, strict=True))) for (of, _), rows in seen.items() if of == name]
        measured = tracker.sensors[name].measurement
        for i, j in combinations(own, 2):
            parts = [part for path in paths if (part := path.along(i, j, measured)) is not None]
            if parts and (found := _correlated(parts)) is not None:
                yield Together(name, (measured.names[i], measured.names[j]), *found)


@frozen(eq=False)
class Taken:
    """What a track took of a sensor: times (s,) in s, returns (s, m), the noise that is stated of them (s, m, m)."""

    times: Array
    z: Array
    noise: Array

    def along(self, i: int, j: int, measured: Space) -> tuple[Array, Array, Array] | None:
        """Return residuals along two axes (2, k) in stated deviations, the same (2, l) over twice the time, and the
        correlation that is stated (k,).
        """
        good = np.isfinite(self.z[:, [i, j]]).all(axis=-1)
        times, R = self.times[good], self.noise[good]
        pair = []
        for axis in (i, j):
            period, values = measured.axes[axis].period, self.z[good, axis]
            values = values if period is None else np.unwrap(values, period=period)
            pair.append(
                [residuals(Measured(times, values, np.arange(len(times), dtype=float)), stride) for stride in (1, 2)]
            )
        (u, rows), (wide, far) = ((np.array([one[k][0] for one in pair]), pair[0][k][1]) for k in (0, 1))
        deviations = np.sqrt(R[:, [i, j], [i, j]].T)
        rows, far = rows.astype(np.int64), far.astype(np.int64)
        stated = R[:, i, j] / np.prod(deviations, axis=0)
        return (u / deviations[:, rows], wide / deviations[:, far], stated[rows]) if len(far) else None


def _correlated(parts: Sequence[tuple[Array, Array, Array]]) -> tuple[float, float, float, int] | None:
    """Return the correlation, its deviation, what is stated and of how many returns; None if that is right or not told."""
    u, wide = (np.concatenate([part[k] for part in parts], axis=-1) for k in (0, 1))
    stated, count = float(np.mean(np.concatenate([part[2] for part in parts]))), u.shape[-1]
    usual, far = np.median(np.abs(u), axis=-1), np.median(np.abs(wide), axis=-1)
    if count < FEWEST or np.any(usual <= 0) or np.any(far**2 > STEADY * usual**2):
        return None
    a, b = u / np.sqrt(np.mean(u**2, axis=-1, keepdims=True))
    found = float(np.mean(a * b))
    off, ends = a * b - found * (a**2 + b**2) / 2.0, np.cumsum([part[0].shape[-1] for part in parts])[:-1]
    deviation = float(np.sqrt(sum(map(long_run, np.split(off, ends)))) / count)
    sure = abs(found - stated) > max(SURE * deviation, MATTERS)
    return (found, deviation, stated, count) if sure else None
