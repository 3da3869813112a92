"""The common part of sensors at a position, fixed or on a platform, that see around them."""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np
from attrs import field, frozen

from vedette import Array, Pose, Sensor, Twin, fields
from vedette_standard import compiled
from vedette_standard.sensors.clutter import check_stated_once, uniform_over
from vedette_standard.sensors.station import covers, placed


@frozen(kw_only=True)
class PlacedSensor(Sensor):
    """A sensor with a position, a direction, range limits, and a number of false returns within its coverage."""

    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    min_range: float = fields.quantity("m", "nothing nearer is detected", default=0.0, at_least=0)
    max_range: float | None = fields.quantity("m", "nothing farther is detected; none: no limit", default=None, above=0)
    clutter_per_scan: float = fields.quantity("1", "expected number of false returns per scan", default=0.0, at_least=0)
    x: float = fields.quantity("m", "where the sensor stands; a scan's own pose replaces it", default=0.0)
    y: float = fields.quantity("m", "where the sensor stands; a scan's own pose replaces it", default=0.0)
    heading: float = fields.quantity("rad", "direction of bearing 0; a scan's own pose replaces it", default=0.0)
    _pose: Pose = field(init=False, repr=False, eq=False)

    @_pose.default
    def _fixed(self) -> Pose:
        return Pose(np.array([self.x, self.y]), heading=self.heading)

    def __attrs_post_init__(self) -> None:
        if self.max_range is not None and self.max_range <= self.min_range:
            raise ValueError(f"max_range: must be > min_range, {self.min_range:g} m, got {self.max_range:g} m")
        if self.clutter_per_scan > 0 and (lacking := self._unbounded()):
            raise ValueError(f"clutter_per_scan: needs {lacking}, which says over what the false returns spread")

    def _unbounded(self) -> str:
        """Return the parameter without which clutter has no density, or ""."""
        return "max_range" if self.max_range is None else ""

    def _twin(self, *parameters: float | Array) -> Twin | None:
        """Return the sensor's compiled twin: its own parameters follow those that all have."""
        most = math.inf if self.max_range is None else self.max_range
        return compiled.placed(self.kind, self._pose, self.detection_probability, self.min_range, most, *parameters)

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b), or () if no range limits it."""
        return covers(self.detection_probability, self.min_range, self.max_range, x[..., :2], self._pose)

    def at(self, pose: Pose) -> Sensor:
        """Return the same on a platform at `pose`, which may lead with batch axes: they are the first of the states' own."""
        return placed(self, pose)


@frozen(kw_only=True)
class RangingSensor(PlacedSensor):
    """One that measures ranges: its clutter is stated by number or by density, and spreads over area or range."""

    clutter_uniform_over: str = uniform_over()

    @property
    @abstractmethod
    def clutter_density(self) -> float:
        """False returns per scan and area, or volume in space; a parameter of the sensor."""

    def __attrs_post_init__(self) -> None:
        check_stated_once(self.clutter_density, self.clutter_per_scan)
        super().__attrs_post_init__()
