"""When a sensor looks, where it sees clutter, what it cannot tell apart, and what its returns lack."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Detections, Sensor, Space, fields
from vedette.sampling import Bounds


@final
@frozen
class Look:
    """When one sensor looks, and where it sees clutter. The sensor's name in the tracker is the look's name.

    >>> look = Look(0.5, first=0.25, jitter=0.2, resolution={"bearing": 0.1})
    >>> late = look.times(500.0, np.random.default_rng(1)) - np.arange(0.25, 500.0, 0.5)
    >>> len(late), bool(np.max(np.abs(late)) <= 0.2), np.allclose(np.mean(late**2), 0.2**2 / 3, rtol=0.1)
    (1000, True, True)
    >>> look.cells(Space.of(range="m", bearing="rad mod 2pi")).tolist()
    [inf, 0.1]
    """

    interval: float = fields.quantity("s", "time from scan to scan", above=0)
    first: float = fields.quantity("s", "time of the first scan", default=0.0, at_least=0)
    jitter: float = fields.quantity("s", "each scan comes early or late by up to this, uniformly", default=0.0, at_least=0)
    clutter: Mapping[str, Bounds] | None = fields.part(
        "where false returns fall: measured axis to low and high; an axis that wraps may be left out; default: no clutter",
        default=None,
    )
    resolution: dict[str, float] = fields.table(
        "measured axis to the size of a cell, in the axis' own unit: objects nearer than that in all of these axes give one "
        "return; default: every object gives its own",
        tried=({},),
    )
    missing: dict[str, float] = fields.table(
        "measured axis to the probability that a return lacks it, where the sensor is 'partial'; default: none does",
        tried=({},),
    )

    def __attrs_post_init__(self) -> None:
        if self.jitter >= 0.5 * self.interval:
            raise ValueError(f"jitter: must be < half the interval of {self.interval:.6g} s, got {self.jitter:.6g} s")
        for name, size in self.resolution.items():
            if size <= 0:
                raise ValueError(f"resolution: {name}: must be > 0, got {size:.6g}")
        for name, share in self.missing.items():
            if not 0 <= share <= 1:
                raise ValueError(f"missing: {name}: must be a probability, got {share:.6g}")

    def times(self, duration: float, rng: np.random.Generator) -> Array:
        """Draw scan times (s,) in s from 0 to `duration`, in order."""
        nominal = np.arange(self.first, duration * (1 + 1e-12), self.interval)
        return np.clip(nominal + self.jitter * rng.uniform(-1.0, 1.0, len(nominal)), 0.0, duration)

    def lacking(self, sensor: Sensor) -> Array:
        """Return the probability that a return lacks each measured axis (m,); ValueError for one that it always reports."""
        if always := [name for name in self.missing if name not in sensor.optional]:
            may = ", ".join(sensor.optional) or "none, as it is not 'partial'"
            raise ValueError(f"{always[0]}: {sensor.kind!r} always reports it; of its axes a return may lack: {may}")
        return np.array([self.missing.get(name, 0.0) for name in sensor.measurement.names])

    def with_gaps(self, seen: Detections, sensor: Sensor, rng: np.random.Generator) -> Detections:
        """Draw which components returns lack."""
        if not self.missing:
            return seen
        missing = rng.random(seen.z.shape) < self.lacking(sensor)
        return evolve(seen, z=np.where(missing, np.nan, seen.z), missing=missing) if missing.any() else seen

    def cells(self, measurement: Space) -> Array:
        """Return the size of a cell on each measured axis (m,), infinite where none is given.

        ValueError if an axis is unknown, or a cell as long as half its axis' period.
        """
        if unknown := [name for name in self.resolution if name not in measurement]:
            raise ValueError(f"{unknown[0]}: is not measured; the measured axes are {measurement}")
        for axis in measurement.axes:
            size = self.resolution.get(axis.name, 0.0)
            if axis.period is not None and size >= 0.5 * axis.period:
                raise ValueError(f"{axis.name}: must be < half the period of {axis.period:.6g}, got {size:.6g}")
        return np.array([self.resolution.get(name, np.inf) for name in measurement.names])
