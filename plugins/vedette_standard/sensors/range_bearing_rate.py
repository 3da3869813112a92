"""A Doppler radar: range, bearing and range rate."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Space, Twin, fields
from vedette_standard.sensors.clutter import per_direction
from vedette_standard.sensors.geometry import NEAR, polar_slope, ranges_and_bearings
from vedette_standard.sensors.placed import RangingSensor
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.station import leading, offsets

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")
_DOPPLER = Space.of(range="m", bearing="rad mod 2pi", range_rate="m/s")


@final
@frozen
class RangeBearingRate(RangingSensor):
    """z = (r, b, r') + v with independent errors; r' is the target's velocity less the platform's, along the line of sight.

    With d = position - platform: r = |d|, b = atan2(dy, dx) - heading, r' = d . (v - v_platform) / r. A pose without a
    velocity is at rest. Clutter is uniform over the area from `min_range` to `max_range`, or over range and bearing, and in
    rate up to `max_rate` either way.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 10.3.

    >>> from vedette import Pose
    >>> sensor = RangeBearingRate(6.0, 0.02, 0.5, max_rate=40.0, max_range=100.0, min_range=30.0, clutter_per_scan=3.0)
    >>> sensor = sensor.at(Pose([10.0, 20.0], [1.0, -2.0], 0.5))
    >>> x = np.array([40.0, 60.0, 6.0, 8.0])  # 30 and 40 m away, 5 and 10 m/s faster than the platform
    >>> np.allclose(sensor.measure(x), [50.0, np.arctan2(40.0, 30.0) - 0.5, 0.6 * 5.0 + 0.8 * 10.0])
    True
    >>> np.allclose(np.diag(sensor.noise(x)), [36.0, 0.0004, 0.25])
    True
    >>> by_differences = [(sensor.measure(x + d) - sensor.measure(x - d)) / 2e-4 for d in 1e-4 * np.eye(4)]
    >>> np.allclose(sensor.jacobian(x), np.transpose(by_differences))
    True
    >>> np.allclose(sensor.clutter(np.array([[50.0, 0.1, 3.0]])), 3.0 * 50.0 / (np.pi * (100.0**2 - 30.0**2)) / 80.0)
    True
    >>> still = RangeBearingRate(6.0, 0.02, 0.5, crossing_speed=7.0).invert(np.array([50.0, 0.0, -9.0]))
    >>> np.allclose(still.mean, [50.0 * np.exp(0.0002), 0.0, -9.0, 0.0])
    True
    >>> np.allclose(still.cov[2:, 2:], np.diag([0.25, 49.0 + 81.0 * 0.0004]))  # along, and across the line of sight
    True
    """

    kind: ClassVar[str] = "range_bearing_rate"
    observes: ClassVar[Space] = _STATE
    measurement: ClassVar[Space] = _DOPPLER

    sigma_range: float = fields.quantity("m", "standard deviation of the range", above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)
    sigma_rate: float = fields.quantity("m/s", "standard deviation of the range rate", above=0)
    max_rate: float | None = fields.quantity("m/s", "largest range rate of a false return", default=None, above=0)
    crossing_speed: float = fields.quantity(
        "m/s", "standard deviation of a new track's speed across the line of sight, which one return leaves open",
        default=10.0, above=0,
    )  # fmt: skip
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)

    def __attrs_post_init__(self) -> None:
        super().__attrs_post_init__()
        if self.clutter_density > 0 and self.max_rate is None:
            raise ValueError("clutter_density: needs max_rate, which says over which rates the false returns spread")

    def _unbounded(self) -> str:
        if self.max_rate is None:
            return "max_rate"
        return super()._unbounded()

    def _approach(self, x: Array) -> tuple[Array, Array, Array]:
        """Return unit vector to the target (*b, 2), the distance as a divisor (*b), and the relative velocity (*b, 2)."""
        d = np.stack(offsets(x[..., :2], self._pose), axis=-1)
        r = np.maximum(np.hypot(d[..., 0], d[..., 1]), NEAR)
        velocity = self._platform_velocity(x.ndim - 1)
        return d / r[..., None], r, x[..., 2:] - velocity

    def _platform_velocity(self, axes: int) -> Array:
        """Return the velocity of the platform, (2,) or to broadcast against states with `axes` batch axes."""
        velocity = self._pose.velocity
        if velocity is None:
            return np.zeros(2)
        return np.stack([leading(velocity[..., 0], axes), leading(velocity[..., 1], axes)], axis=-1)

    @property
    def twin(self) -> Twin | None:
        velocity = self._pose.velocity
        vx, vy = (0.0, 0.0) if velocity is None else (velocity[..., 0], velocity[..., 1])
        return self._twin(self.sigma_range**2, self.sigma_bearing**2, self.sigma_rate**2, vx, vy)

    def measure(self, x: Array) -> Array:
        to_target, _, v = self._approach(x)
        z = np.empty((*x.shape[:-1], 3))
        z[..., :2] = ranges_and_bearings(x[..., :2], self._pose)
        z[..., 2] = np.sum(to_target * v, axis=-1)
        return _DOPPLER.canonical(z)

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, 4) -> (*b, 3, 4); within 1 mm that of a target 1 mm away, times the distance in mm."""
        to_target, r, v = self._approach(x)
        near = np.hypot(to_target[..., 0], to_target[..., 1])  # 1 except within a millimetre
        rate = np.sum(to_target * v, axis=-1)
        H = np.zeros((*x.shape[:-1], 3, 4))
        H[..., :2, :2] = polar_slope(x[..., :2], self._pose)
        H[..., 2, :2] = (v - rate[..., None] * to_target) * (near / r)[..., None]
        H[..., 2, 2:] = to_target
        return H

    def noise(self, x: Array) -> Array:
        return np.diag([self.sigma_range**2, self.sigma_bearing**2, self.sigma_rate**2])

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 3) -> (*b, k) in 1/(m rad m/s), or () if it is the same everywhere."""
        if self.max_rate is None:
            return np.asarray(0.0)
        return per_direction(self, z[..., 0], 2) / (2 * self.max_rate)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return the unbiased position and the velocity, unknown across the line of sight: (*b, 3) -> (*b, 4), (*b, 4, 4).

        Over the radar there is no line of sight: the speed is unknown. On a moving platform an error of the bearing errs in
        the part of the platform's own velocity that is along the line of sight, too.
        """
        R = np.broadcast_to(self.noise(z) if noise is None else noise, (*z.shape, 3))
        polar = RangeBearing(self.sigma_range, self.sigma_bearing).at(self._pose).invert(z[..., :2], R[..., :2, :2])
        angle = z[..., 1] + leading(self._pose.heading, z.ndim - 1)
        along = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
        across = np.stack([-along[..., 1], along[..., 0]], axis=-1)
        velocity = self._platform_velocity(z.ndim - 1)
        drift, turning = np.sum(along * velocity, axis=-1), np.sum(across * velocity, axis=-1)
        # An error of the bearing takes `turning` of the platform's own velocity for the target's, as far as it errs across.
        aside = np.sqrt(np.maximum(np.einsum("...i,...ij,...j", across, polar.cov, across), 0.0) / R[..., 1, 1])
        outer = along[..., :, None] * along[..., None, :]
        sighted = R[..., 2, 2] + turning * (2.0 * R[..., 1, 2] + turning * R[..., 1, 1])
        sighted = sighted + np.where(z[..., 0] > NEAR, 0.0, self.crossing_speed**2)
        open_speed = self.crossing_speed**2 + z[..., 2] ** 2 * R[..., 1, 1]
        mean, cov = np.empty((*z.shape[:-1], 4)), np.zeros((*z.shape[:-1], 4, 4))
        mean[..., :2], mean[..., 2:] = polar.mean, (z[..., 2] + drift)[..., None] * along
        cov[..., :2, :2] = polar.cov
        cov[..., 2:, 2:] = sighted[..., None, None] * outer
        cov[..., 2:, 2:] += open_speed[..., None, None] * across[..., :, None] * across[..., None, :]
        shared = (R[..., 0, 2] + turning * R[..., 0, 1])[..., None, None] * outer
        shared = (
            shared
            + (aside * (R[..., 1, 2] + turning * R[..., 1, 1]))[..., None, None] * across[..., None] * along[..., None, :]
        )
        cov[..., :2, 2:], cov[..., 2:, :2] = shared, np.swapaxes(shared, -1, -2)
        return Gaussian(mean, cov)
