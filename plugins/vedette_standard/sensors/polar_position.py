"""A radar that reports positions in the plane, with the errors of range and bearing."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, Twin, fields
from vedette_standard.sensors.clutter import per_direction
from vedette_standard.sensors.direct import DirectSensor
from vedette_standard.sensors.placed import RangingSensor
from vedette_standard.sensors.station import POSITION, offsets
from vedette_standard.sensors.view import width

_NEAR = 1e-6
"""Distance in m within which the direction fades out of the noise."""
_ROUNDING = 1e-14
"""Least part of the noise in one direction that is in the other: R would be singular to rounding with less."""


@final
@frozen
class PolarPosition(RangingSensor, DirectSensor):
    """z = position + v in the tracker's own frame, with v from the errors of range and bearing at the target.

    v ~ N(0, T diag(sigma_range^2, (r^2 + sigma_range^2) sigma_bearing^2) T' + sigma_extent^2 I), T the rotation to the
    target's direction from the radar, r its distance; r^2 + sigma_range^2 is the mean square of the measured range. Over the
    radar itself there is no direction: the noise is the mean over all directions.
    The reported returns are used as they are; noise is evaluated at the state, which is more precise than one return.
    Clutter of n = `clutter_per_scan` is uniform over the area from `min_range` to `max_range`; over range and bearing, as a
    receiver's cells make it, it is of density n / (2 pi (max - min) r) per area at the range r.
    Lerro, Bar-Shalom, Tracking with Debiased Consistent Converted Measurements versus EKF, IEEE T-AES 29, 1993.

    >>> view = {"min_range": 30.0, "max_range": 100.0, "clutter_per_scan": 3.0}
    >>> sensor = PolarPosition(6.0, 0.02, sigma_extent=3.0, x=10.0, y=20.0, **view)
    >>> x, f, n = np.array([40.0, 60.0]), np.array([0.6, 0.8]), np.array([-0.8, 0.6])  # 50 m away
    >>> R = 36.0 * np.outer(f, f) + (2500.0 + 36.0) * 0.0004 * np.outer(n, n) + 9.0 * np.eye(2)
    >>> sensor.measure(x).tolist(), np.allclose(sensor.noise(x), R), np.allclose(sensor.invert(x).cov, R)
    ([40.0, 60.0], True, True)
    >>> np.allclose(sensor.clutter(x[None]), 3.0 / (np.pi * (100.0**2 - 30.0**2)))
    True
    >>> evenly = PolarPosition(6.0, 0.02, clutter_uniform_over="range", **view)
    >>> np.allclose(evenly.clutter(np.array([[30.0, 40.0]])), 3.0 / (2.0 * np.pi * 70.0 * 50.0))
    True
    >>> sensor.detects(np.array([[40.0, 60.0], [10.0, 21.0], [10.0, 121.0]])).tolist()
    [1.0, 0.0, 0.0]
    """

    kind: ClassVar[str] = "polar_position"
    observes: ClassVar[Space] = POSITION

    sigma_range: float = fields.quantity("m", "standard deviation along the line of sight", above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)
    sigma_extent: float = fields.quantity(
        "m", "standard deviation per axis of where on the target it is seen", default=0.0, at_least=0
    )
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    max_range: float | None = fields.quantity("m", "nothing farther is detected; none: no limit", default=None, above=0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)
    x: float = fields.quantity("m", "where the radar stands; a scan's own pose replaces it", default=0.0)
    y: float = fields.quantity("m", "where the radar stands; a scan's own pose replaces it", default=0.0)
    min_range: float = fields.quantity("m", "nothing nearer is detected", default=0.0, at_least=0)
    clutter_per_scan: float = fields.quantity("1", "expected number of false returns per scan", default=0.0, at_least=0)

    def __attrs_post_init__(self) -> None:
        super().__attrs_post_init__()
        if self.clutter_per_scan > 0 and self.clutter_uniform_over == "range" and self.min_range == 0:
            raise ValueError("clutter_uniform_over: 'range' needs min_range > 0, as the density per area is infinite at 0 m")

    @property
    def twin(self) -> Twin | None:
        return self._twin(self.sigma_range**2, self.sigma_bearing**2, self.sigma_extent**2)

    def noise(self, x: Array) -> Array:
        dx, dy = offsets(x, self._pose)
        xx, yy, square = dx * dx + 0.5 * _NEAR**2, dy * dy + 0.5 * _NEAR**2, dx * dx + dy * dy + _NEAR**2
        radial = self.sigma_range**2
        tangential = (square + radial) * self.sigma_bearing**2
        least = _ROUNDING * (radial + tangential)
        along, across = np.maximum(radial, least), np.maximum(tangential, least)
        R = np.empty((*dx.shape, 2, 2))
        R[..., 0, 0] = (along * xx + across * yy) / square + self.sigma_extent**2
        R[..., 1, 1] = (along * yy + across * xx) / square + self.sigma_extent**2
        R[..., 0, 1] = R[..., 1, 0] = (along - across) * dx * dy / square
        return R

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 2) -> (*b, k) in 1/m^2, or () if it is the same everywhere."""
        if self.clutter_per_scan == 0:
            return np.asarray(self.clutter_density)
        if self.clutter_uniform_over == "area" and self.polygons:
            return np.asarray(self.clutter_per_scan / self._size)
        if self.clutter_uniform_over == "area" and self.max_range is not None:
            return np.asarray(self.clutter_per_scan / (0.5 * width(self.sectors) * (self.max_range**2 - self.min_range**2)))
        r = np.hypot(*offsets(z, self._pose))
        return per_direction(self, r, 2) / np.clip(r, self.min_range, self.max_range)
