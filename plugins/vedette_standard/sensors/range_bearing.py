"""A radar that measures range and bearing."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Space, Twin, fields
from vedette_standard.compiled import fastest
from vedette_standard.sensors.clutter import per_direction
from vedette_standard.sensors.geometry import polar_slope, ranges_and_bearings
from vedette_standard.sensors.placed import RangingSensor
from vedette_standard.sensors.station import POSITION, leading, offsets

_POLAR = Space.of(range="m", bearing="rad mod 2pi")


@final
@frozen
class RangeBearing(RangingSensor):
    """z = (r, b) + v, v ~ N(0, diag(sigma_range^2, sigma_bearing^2)), of a target in the plane as seen from the radar.

    An extended target is seen anywhere on it, with the variance s^2 = sigma_extent^2 per axis: it adds s^2 to that of the
    range and s^2 / (r^2 + s^2) to that of the bearing.
    With (dx, dy) = position - (x, y): r = sqrt(dx^2 + dy^2), b = atan2(dy, dx) - heading, from +x towards +y.
    Over the radar itself the bearing is that of +x and the derivative 0: such a return carries no position.
    Clutter of n = `clutter_per_scan` is uniform over the area from `min_range` to `max_range`, hence of density
    n r / (pi (max^2 - min^2)) in z; over range and bearing it is n / (2 pi (max - min)); `clutter_density` c gives c r. In
    sectors their angle stands for 2 pi, in polygons the area in view counts.
    Mo, Song, Zhou, Sun, Bar-Shalom, Unbiased Converted Measurements for Tracking, IEEE T-AES 34, 1998 (for `invert`).

    >>> from vedette import Pose
    >>> around = {"min_range": 30.0, "max_range": 100.0}
    >>> place = {"x": 10.0, "y": 20.0, "heading": 0.5}
    >>> sensor = RangeBearing(6.0, 0.02, detection_probability=0.8, clutter_per_scan=3.0, **around, **place)
    >>> x = np.array([40.0, 60.0])  # 30 and 40 m away, so 50 m
    >>> np.allclose(sensor.measure(x), [50.0, np.arctan2(40.0, 30.0) - 0.5]), sensor.noise(x).round(9).tolist()
    (True, [[36.0, 0.0], [0.0, 0.0004]])
    >>> sensor.jacobian(x).round(9).tolist(), sensor.detects(np.array([[40.0, 60.0], [10.0, 21.0], [10.0, 121.0]])).tolist()
    ([[0.6, 0.8], [-0.016, 0.012]], [0.8, 0.0, 0.0])
    >>> long = RangeBearing(6.0, 0.02, sigma_extent=8.0, clutter_per_scan=3.0, clutter_uniform_over="range", **around)
    >>> np.allclose(long.noise(np.array([30.0, 40.0])), np.diag([36.0 + 64.0, 0.0004 + 64.0 / (2500.0 + 64.0)]))
    True
    >>> z = np.array([[50.0, 1.0], [80.0, -2.0]])
    >>> np.allclose(sensor.clutter(z), 3.0 * z[:, 0] / (np.pi * (100.0**2 - 30.0**2)))
    True
    >>> dense = RangeBearing(6.0, 0.02, 1e-4)
    >>> np.allclose(long.clutter(z), 3.0 / (2.0 * np.pi * 70.0)), np.allclose(dense.clutter(z), 1e-4 * z[:, 0])
    (True, True)
    >>> found, s, b = sensor.invert(z), 0.0004, z[:, 1] + 0.5
    >>> np.allclose(found.mean, [10.0, 20.0] + z[:, :1] * np.exp(s / 2.0) * np.stack([np.cos(b), np.sin(b)], axis=-1))
    True
    >>> f, n, square = np.array([np.cos(1.5), np.sin(1.5)]), np.array([-np.sin(1.5), np.cos(1.5)]), 2500.0 + 36.0
    >>> wanted = (square * np.cosh(s) - 2500.0) * np.outer(f, f) + square * np.sinh(s) * np.outer(n, n)
    >>> np.allclose(found.cov[0], wanted)
    True
    >>> there = sensor.at(Pose([10.0, 60.0], heading=-0.5))  # the pose of a scan replaces the sensor's own
    >>> there.measure(x).tolist()
    [30.0, 0.5]
    """

    kind: ClassVar[str] = "range_bearing"
    abbreviations: ClassVar[tuple[str, ...]] = ("radar",)
    observes: ClassVar[Space] = POSITION
    measurement: ClassVar[Space] = _POLAR

    sigma_range: float = fields.quantity("m", "standard deviation of the range", above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)
    sigma_extent: float = fields.quantity(
        "m", "standard deviation per axis of where on the target it is seen", default=0.0, at_least=0
    )

    @property
    def twin(self) -> Twin | None:
        return self._twin(self.sigma_range**2, self.sigma_bearing**2, self.sigma_extent**2)

    def measure(self, x: Array) -> Array:
        return _POLAR.canonical(ranges_and_bearings(x, self._pose))

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, 2) -> (*b, 2, 2); within 1 mm that of a target 1 mm away, times the distance in mm."""
        return polar_slope(x, self._pose)

    def noise(self, x: Array) -> Array:
        """Return R: (*b, 2) -> (*b, 2, 2), or (2, 2) of a point."""
        if self.sigma_extent == 0:
            return np.diag([self.sigma_range**2, self.sigma_bearing**2])
        return self._noise_at(np.hypot(*offsets(x, self._pose)))

    def _noise_at(self, r: Array) -> Array:
        """Return R of targets at a range: (*b) -> (*b, 2, 2)."""
        R, extent = np.zeros((*r.shape, 2, 2)), self.sigma_extent**2
        R[..., 0, 0] = self.sigma_range**2 + extent
        R[..., 1, 1] = self.sigma_bearing**2
        if extent > 0:
            R[..., 1, 1] += extent / (r * r + extent)
        return R

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 2) -> (*b, k) in 1/(m rad), or () if it is the same everywhere."""
        return per_direction(self, z[..., 0], 2)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return the unbiased position and its covariance: (*b, 2) -> (*b, 2), (*b, 2, 2).

        An error e of the bearing, of variance s, shortens the converted position on average by E cos(e) = exp(-s/2): the
        mean is divided by that. Its covariance for independent errors is then (r^2 + sigma_range^2) cosh(s) - r^2 along the
        line of sight and (r^2 + sigma_range^2) sinh(s) across: J R J' to first order, and definite at r = 0 too.
        """
        R, place = self._noise_at(z[..., 0]) if noise is None else noise, self._pose
        return Gaussian(*from_polar(z, R, place.position[..., 0], place.position[..., 1], place.heading))


@fastest
def from_polar(z: Array, R: Array, x: Array, y: Array, heading: float | Array) -> tuple[Array, Array]:
    """Return the positions and covariances of ranges and bearings with noise, for a sensor at x and y."""
    r, angle, s = z[..., 0], z[..., 1] + leading(heading, z.ndim - 1), R[..., 1, 1]
    cos, sin = np.cos(angle), np.sin(angle)
    mean = np.empty((*angle.shape, 2))
    mean[..., 0] = leading(x, angle.ndim) + r * np.exp(s / 2) * cos
    mean[..., 1] = leading(y, angle.ndim) + r * np.exp(s / 2) * sin
    along = R[..., 0, 0] * np.cosh(s) + r * r * 2 * np.sinh(s / 2) ** 2
    across = (r * r + R[..., 0, 0]) * np.sinh(s)
    mixed, cos2, sin2, both = r * R[..., 0, 1], cos * cos, sin * sin, sin * cos
    cov = np.empty((*angle.shape, 2, 2))
    cov[..., 0, 0] = along * cos2 + across * sin2 - 2 * mixed * both
    cov[..., 1, 1] = along * sin2 + across * cos2 + 2 * mixed * both
    cov[..., 0, 1] = cov[..., 1, 0] = (along - across) * both + mixed * (cos2 - sin2)
    return mean, cov
