"""Where a sensor's returns can lie, so that the number of false ones which a clutter density makes is known."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from attrs import field, frozen

from vedette import Array, ImagingSensor, Mask, Pose, Scan, Sensor

POINTS = 256
"""Points at which densities are averaged over a view."""


@frozen(eq=False)
class Cover:
    """Points (p, m) spread evenly over a view, each standing for a part of its `volume`."""

    points: Array
    volume: float

    def total(self, density: Array) -> float:
        """Return the integral of a density, given at the points (p,) or the same everywhere ()."""
        if not len(self.points):
            return 0.0
        return self.volume * float(density if density.ndim == 0 else np.mean(density))


@frozen(eq=False)
class View:
    """The box of the returns of one sensor, from `low` to `high` (m,); `moves`: about the platform.

    A periodic axis is the whole circle unless a tenth of it is empty. The box is that of k returns, wider by (k+1)/(k-1),
    which makes it right on average where they are even.
    """

    low: Array
    high: Array
    moves: bool
    count: int
    _kept: dict[str, Cover] = field(init=False, factory=dict, repr=False)

    @property
    def volume(self) -> float:
        """Of the whole box."""
        return float(np.prod(self.high - self.low))

    @property
    def doubt(self) -> float:
        """The standard error of the volume's logarithm: each of m axes is guessed from k returns to sqrt(2) / k."""
        return math.sqrt(2.0 * len(self.low)) / self.count

    def cover(self, sensor: Sensor, pose: Pose | None) -> Cover:
        """Return points over the part of the view in which the sensor, placed at `pose`, can detect anything."""
        if pose is None and "here" in self._kept:
            return self._kept["here"]
        points = self.low + (self.high - self.low) * even(POINTS, len(self.low))
        if self.moves and pose is not None:
            points = points + pose.position
        try:
            inside = np.broadcast_to(sensor.detects(sensor.invert(points).mean) > 0, len(points))
        except NotImplementedError:
            inside = np.broadcast_to(sensor.covers(points), len(points))
        made = Cover(points[inside], self.volume * float(np.mean(inside)))
        if pose is None:
            self._kept["here"] = made
        return made


def views(sensors: Mapping[str, Sensor], scans: Sequence[Scan], of: Sequence[Mask] | None = None) -> dict[str, View]:
    """Return the view of each sensor that has returns in enough places; cameras have none.

    of: which returns (k,) of each scan to go by; None: all.
    """
    returns: dict[str, list[Array]] = {}
    for i, scan in enumerate(scans):
        sensor, seen = sensors[scan.sensor], scan.detections
        if isinstance(sensor, ImagingSensor):
            continue
        whole = seen.complete if of is None else seen.complete & of[i]
        moves = _moves(sensor, scan.pose)
        z = seen.z[whole] - scan.pose.position if moves and scan.pose is not None else seen.z[whole]
        returns.setdefault(scan.sensor, []).append(z)
    views = {}
    for name, parts in returns.items():
        sensor, z = sensors[name], np.concatenate(parts)
        moves = any(scan.sensor == name and _moves(sensor, scan.pose) for scan in scans)
        if len(z) > len(sensor.measurement) and np.all(np.ptp(z, axis=0) > 0):
            views[name] = _box(sensor, z, moves)
    return views


def _moves(sensor: Sensor, pose: Pose | None) -> bool:
    """Return whether a sensor measures positions in the tracker's frame from a platform, which its view goes with."""
    if pose is None or sensor.measurement.axes != sensor.observes.axes:
        return False
    return pose.position.shape == (len(sensor.measurement),) and all(axis.unit == "m" for axis in sensor.measurement.axes)


def _box(sensor: Sensor, z: Array, moves: bool) -> View:
    low, high = np.min(z, axis=0), np.max(z, axis=0)
    for i, period in sensor.measurement.periods:
        angles = np.sort(np.mod(z[:, i], period))
        gaps = np.diff(np.append(angles, angles[0] + period))
        widest = int(np.argmax(gaps))
        if gaps[widest] < 0.1 * period:
            low[i], high[i] = 0.0, period
        else:
            low[i] = angles[(widest + 1) % len(angles)]
            high[i] = low[i] + period - gaps[widest]
    wider = 0.5 * (high - low) * ((len(z) + 1) / (len(z) - 1) - 1.0)
    circles = [i for i, period in sensor.measurement.periods if high[i] - low[i] == period]
    wider[circles] = 0.0
    return View(low - wider, high + wider, moves, len(z))


def even(count: int, axes: int) -> Array:
    """Return points (count, axes) spread evenly over the unit cube, by multiples of the generalised golden ratio."""
    ratio = 2.0
    for _ in range(40):
        ratio = (1.0 + ratio) ** (1.0 / (axes + 1))
    step = ratio ** -np.arange(1.0, axes + 1.0)
    return np.mod(0.5 + np.outer(np.arange(count), step), 1.0)
