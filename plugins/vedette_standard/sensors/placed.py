"""The common part of sensors that see around a place, fixed or on a platform: their field of view, and who it detects."""

from __future__ import annotations

import math
from abc import abstractmethod

import numpy as np
from attrs import field, frozen

from vedette import Array, Mask, Pose, Sensor, Twin, fields
from vedette_standard import compiled
from vedette_standard.regions import Polygon, held
from vedette_standard.sensors.clutter import check_stated_once, uniform_over
from vedette_standard.sensors.geometry import ranges_and_bearings
from vedette_standard.sensors.station import POSITION, covers, placed
from vedette_standard.sensors.view import Detection, Sector, check_apart, directed, size

_TRIED = (Detection(np.array([[0.9, 0.5], [0.6, 0.2]]), np.array([0.0, 500.0]), np.array([-1.0, 1.0])), None)


@frozen(kw_only=True)
class PlacedSensor(Sensor):
    """A sensor with a position, a direction, a field of view, and a number of false returns within it.

    It sees what lies within its ranges, in one of its `sectors` and in one of its `polygons`, where it has any. The
    detection probability is `detection_probability` times that of the table `detection` there, and 0 outside.
    """

    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    min_range: float = fields.quantity("m", "nothing nearer is detected", default=0.0, at_least=0)
    max_range: float | None = fields.quantity("m", "nothing farther is detected; none: no limit", default=None, above=0)
    clutter_per_scan: float = fields.quantity("1", "expected number of false returns per scan", default=0.0, at_least=0)
    x: float = fields.quantity("m", "where the sensor stands; a scan's own pose replaces it", default=0.0)
    y: float = fields.quantity("m", "where the sensor stands; a scan's own pose replaces it", default=0.0)
    heading: float = fields.quantity("rad", "direction of bearing 0; a scan's own pose replaces it", default=0.0)
    sectors: tuple[Sector, ...] = fields.part(
        "directions in which it sees; default: all around",
        default=(), tried=((), (Sector(-1.0, 1.0),), (Sector(-0.5, 0.5), Sector(2.0, 4.0))),
    )  # fmt: skip
    polygons: tuple[Polygon, ...] = fields.part(
        "areas of the tracker's frame that it sees; default: everywhere", default=(), tried=((),)
    )
    detection: Detection | None = fields.part(
        "table over range and bearing, by which the detection probability is multiplied; default: 1 everywhere",
        default=None, tried=_TRIED,
    )  # fmt: skip
    _pose: Pose = field(init=False, repr=False, eq=False)
    _size: float = field(init=False, repr=False, eq=False, default=0.0)
    _everywhere: Array | None = field(init=False, repr=False, eq=False, default=None)

    def __attrs_post_init__(self) -> None:
        object.__setattr__(self, "_pose", Pose(np.array([self.x, self.y]), heading=self.heading))
        if self.max_range is not None and self.max_range <= self.min_range:
            raise ValueError(f"max_range: must be > min_range, {self.min_range:g} m, got {self.max_range:g} m")
        check_apart(self.sectors)
        if self._unlimited():
            object.__setattr__(self, "_everywhere", np.asarray(self.detection_probability))
        if self.clutter_per_scan > 0:
            if lacking := self._unbounded():
                raise ValueError(f"clutter_per_scan: needs {lacking}, which says over what the false returns spread")
            if power := self._summed():
                object.__setattr__(self, "_size", self._seen(self._pose, power))

    @property
    def pose(self) -> Pose:
        """Where it stands."""
        return self._pose

    def _unlimited(self) -> bool:
        """Return whether it detects alike everywhere."""
        return self._sees_alike and self.max_range is None and self.min_range == 0

    def _unbounded(self) -> str:
        """Return the parameter without which clutter has no density, or ""."""
        return "max_range" if self.max_range is None and not self.polygons else ""

    def _summed(self) -> int:
        """Return what its clutter spreads over if that has to be summed up, else 0: 2 the area, 1 range and bearing."""
        return 2 if self.polygons else 0

    def _boxes(self) -> tuple[Polygon, ...]:
        """Return further areas, outside of each of which it sees nothing."""
        return ()

    def _seen(self, pose: Pose, power: int) -> float:
        seen = size(
            self.sectors, self.polygons, self._boxes(), self.min_range, self.max_range,
            pose.position[:2], float(pose.heading), power,
        )  # fmt: skip
        if seen <= 0:
            raise ValueError("polygons: must lie within the sensor's ranges and sectors, or it sees nothing")
        return seen

    def _twin(self, *parameters: float | Array) -> Twin | None:
        """Return the sensor's compiled twin, which knows ranges alone: its own parameters follow those that all have."""
        if not self._sees_alike:
            return None
        most = math.inf if self.max_range is None else self.max_range
        return compiled.placed(self.kind, self._pose, self.detection_probability, self.min_range, most, *parameters)

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b), or () if nothing limits the view."""
        if self._everywhere is not None:  # asked at each scan
            return self._everywhere
        limited = covers(self.detection_probability, self.min_range, self.max_range, x[..., :2], self._pose)
        return limited if self._sees_alike else limited * self._share(x[..., :2])

    @property
    def _sees_alike(self) -> bool:
        return not self.sectors and not self.polygons and self.detection is None

    def _share(self, spot: Array) -> Array:
        """Return by how much the detection probability at places (*b, 2) is lower than elsewhere within range, (*b)."""
        polar = ranges_and_bearings(spot, self._pose)
        inside = directed(self.sectors, polar[..., 1]) & held(self.polygons, spot)
        return np.where(inside, 1.0 if self.detection is None else self.detection.at(polar[..., 0], polar[..., 1]), 0.0)

    def covers(self, z: Array) -> Mask:
        """Return whether a false return may lie at z: (*b, m) -> (*b), or () if anywhere."""
        r, bearing, spot = self._located(z)
        inside: Mask = np.ones((), dtype=bool)
        if r is not None and (self.max_range is not None or self.min_range > 0):
            inside = (r >= self.min_range) & (self.max_range is None or r <= self.max_range)
        if bearing is not None and self.sectors:
            inside = inside & directed(self.sectors, bearing)
        return inside & held(self.polygons, spot) if spot is not None and self.polygons else inside

    def polar(self, x: Array) -> Array:
        """Return range in m and bearing in rad, not wrapped, at which it sees places: (*b, n) -> (*b, 2)."""
        return ranges_and_bearings(x[..., :2], self._pose)

    def _located(self, z: Array) -> tuple[Array | None, Array | None, Array | None]:
        """Return what a return (*b, m) says of range (*b), bearing (*b) and place (*b, 2); None: nothing."""
        names = self.measurement.names
        if names[:2] == POSITION.names:
            polar = ranges_and_bearings(z[..., :2], self._pose)
            return polar[..., 0], polar[..., 1], z[..., :2]
        r = z[..., names.index("range")] if "range" in names else None
        bearing = z[..., names.index("bearing")] if "bearing" in names else None
        if not self.polygons or r is None or bearing is None:
            return r, bearing, None
        flat = r * np.cos(z[..., names.index("elevation")]) if "elevation" in names else r
        angle = bearing + self._pose.heading
        return r, bearing, self._pose.position[:2] + flat[..., None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)

    def at(self, pose: Pose) -> Sensor:
        """Return the same on a platform at `pose`, which may lead with batch axes: they are the first of the states' own."""
        there = placed(self, pose)
        if self._size:
            if pose.position.ndim > 1:
                raise ValueError(
                    "clutter_per_scan: give clutter_density instead, as what many platforms see differs in size"
                )
            object.__setattr__(there, "_size", there._seen(pose, self._summed()))
        return there


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

    def _summed(self) -> int:
        return (2 if self.clutter_uniform_over == "area" else 1) if self.polygons else 0
