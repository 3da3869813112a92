"""A radar in space: range, bearing and elevation."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Gaussian, Pose, Space, Twin, fields
from vedette_standard.sensors.clutter import per_direction
from vedette_standard.sensors.geometry import NEAR
from vedette_standard.sensors.placed import RangingSensor
from vedette_standard.sensors.station import leading, offsets

_STATE = Space.of(x="m", y="m", z="m")
_SPHERICAL = Space.of(range="m", bearing="rad mod 2pi", elevation="rad mod 2pi")


@final
@frozen
class RangeBearingElevation(RangingSensor):
    """z = (r, b, e) + v with independent errors, of a target in space: z is up, e = atan2(dz, sqrt(dx^2 + dy^2)).

    With a pose of two coordinates the radar stays at its own height; a pose may have three. Clutter is uniform over the
    volume between two spheres, hence of density 3 n r^2 cos(e) / (4 pi (max^3 - min^3)) in z; over range and direction it is
    n cos(e) / (4 pi (max - min)). A table `detection` is by the range over ground.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 10.4.

    >>> import numpy as np
    >>> sensor = RangeBearingElevation(6.0, 0.02, 0.03, x=10.0, y=20.0, z=5.0, heading=0.5, min_range=30.0, max_range=200.0)
    >>> x = np.array([40.0, 60.0, 125.0])  # 30, 40 and 120 m away, so 50 over ground and 130
    >>> np.allclose(sensor.measure(x), [130.0, np.arctan2(40.0, 30.0) - 0.5, np.arctan2(120.0, 50.0)])
    True
    >>> np.allclose(np.diag(sensor.noise(x)), [36.0, 0.0004, 0.0009])
    True
    >>> by_differences = [(sensor.measure(x + d) - sensor.measure(x - d)) / 2e-4 for d in 1e-4 * np.eye(3)]
    >>> np.allclose(sensor.jacobian(x), np.transpose(by_differences))
    True
    >>> sensor.detects(np.array([x, [10.0, 20.0, 34.0], [10.0, 20.0, 206.0]])).tolist()
    [1.0, 0.0, 0.0]
    >>> import attrs
    >>> full, z, e = attrs.evolve(sensor, clutter_per_scan=3.0), np.array([[130.0, 1.0, 1.1]]), np.cos(1.1)
    >>> np.allclose(full.clutter(z), 3.0 * 3.0 * 130.0**2 * e / (4.0 * np.pi * (200.0**3 - 30.0**3)))
    True
    >>> evenly = attrs.evolve(full, clutter_uniform_over="range")
    >>> np.allclose(evenly.clutter(z), 3.0 * e / (4.0 * np.pi * 170.0))
    True
    >>> rng, found = np.random.default_rng(1), sensor.invert(z)
    >>> r, b, e = (z[0] + [0.0, 0.5, 0.0] + rng.standard_normal((200000, 3)) * [6.0, 0.02, 0.03]).T
    >>> true = np.stack([10.0 + r * np.cos(b) * np.cos(e), 20.0 + r * np.sin(b) * np.cos(e), 5.0 + r * np.sin(e)])
    >>> off = true - found.mean.T  # what may be there, given the return: the mean square error
    >>> np.allclose(found.cov[0], off @ off.T / 200000, rtol=0.02, atol=0.3)
    True
    """

    kind: ClassVar[str] = "range_bearing_elevation"
    observes: ClassVar[Space] = _STATE
    measurement: ClassVar[Space] = _SPHERICAL

    sigma_range: float = fields.quantity("m", "standard deviation of the range", above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)
    sigma_elevation: float = fields.quantity("rad", "standard deviation of the elevation", above=0, at_most=1)
    z: float = fields.quantity("m", "height at which the radar stands", default=0.0)
    clutter_density: float = fields.quantity("1/m^3", "false returns per scan and volume", default=0.0, at_least=0)

    @property
    def pose(self) -> Pose:
        """Where it stands, its height too."""
        position = self._pose.position
        height = np.broadcast_to(self._height(position.ndim - 1), position.shape[:-1])
        return evolve(self._pose, position=np.concatenate([position[..., :2], height[..., None]], axis=-1))

    def _height(self, axes: int) -> Array:
        position = self._pose.position
        return leading(position[..., 2], axes) if position.shape[-1] > 2 else np.asarray(self.z)

    def _offsets(self, x: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Return dx, dy, dz, horizontal and slant distance, (*b) each."""
        dx, dy = offsets(x[..., :2], self._pose)
        dz = x[..., 2] - self._height(x.ndim - 1)
        flat = np.hypot(dx, dy)
        return dx, dy, dz, flat, np.hypot(flat, dz)

    @property
    def twin(self) -> Twin | None:
        return self._twin(self.sigma_range**2, self.sigma_bearing**2, self.sigma_elevation**2, self._height(0))

    def measure(self, x: Array) -> Array:
        dx, dy, dz, flat, r = self._offsets(x)
        z = np.stack([r, np.arctan2(dy, dx) - leading(self._pose.heading, dx.ndim), np.arctan2(dz, flat)], axis=-1)
        return _SPHERICAL.canonical(z)

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, 3) -> (*b, 3, 3); finite over the radar, and for a target straight above it."""
        dx, dy, dz, flat, r = self._offsets(x)
        r = np.maximum(r, NEAR)
        H = np.zeros((*x.shape, 3))
        H[..., 2, 2] = flat / r**2
        flat = np.maximum(flat, NEAR)
        H[..., 0, 0], H[..., 0, 1], H[..., 0, 2] = dx / r, dy / r, dz / r
        H[..., 1, 0], H[..., 1, 1] = -dy / flat**2, dx / flat**2
        H[..., 2, 0], H[..., 2, 1] = -dx * dz / (flat * r**2), -dy * dz / (flat * r**2)
        return H

    def noise(self, x: Array) -> Array:
        return np.diag([self.sigma_range**2, self.sigma_bearing**2, self.sigma_elevation**2])

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, 3) -> (*b), or () if no range limits it."""
        share = self.detection_probability if self._sees_alike else self.detection_probability * self._share(x[..., :2])
        if self.max_range is None and self.min_range == 0:
            return np.asarray(share)
        r = self._offsets(x)[-1]
        inside = (r >= self.min_range) & (r <= (math.inf if self.max_range is None else self.max_range))
        return np.where(inside, share, 0.0)

    def _unbounded(self) -> str:
        return "max_range" if self.max_range is None else ""

    def _summed(self) -> int:
        if self.polygons:
            raise ValueError("clutter_per_scan: give clutter_density instead, as polygons say nothing of the height")
        return 0

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 3) -> (*b, k) in 1/(m rad^2), or () if there is none."""
        upright = np.maximum(np.cos(z[..., 2]), 0.0)
        return 0.5 * per_direction(self, z[..., 0], 3) * upright

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return position and mean square error: (*b, 3) -> (*b, 3), (*b, 3, 3).

        The true range and angles lie around the reported ones with independent Gaussian errors; the moments of their sines
        and cosines are exact, so the covariance is definite at any range and straight overhead.
        """
        R = np.broadcast_to(self.noise(z) if noise is None else noise, (*z.shape, 3))
        r, b, e = z[..., 0], z[..., 1] + leading(self._pose.heading, z.ndim - 1), z[..., 2]
        q, s, t = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
        named = np.stack([r * np.cos(b) * np.cos(e), r * np.sin(b) * np.cos(e), r * np.sin(e)], axis=-1)
        short_b, short_e = np.exp(-0.5 * s), np.exp(-0.5 * t)
        expected = named * np.stack([short_b * short_e, short_b * short_e, short_e], axis=-1)
        cos_b, sin_b, mix_b = _squares(b, s)
        cos_e, sin_e, mix_e = _squares(e, t)
        second = np.empty((*z.shape, 3))
        second[..., 0, 0], second[..., 1, 1], second[..., 2, 2] = cos_b * cos_e, sin_b * cos_e, sin_e
        second[..., 0, 1] = second[..., 1, 0] = mix_b * cos_e
        second[..., 0, 2] = second[..., 2, 0] = short_b * np.cos(b) * mix_e
        second[..., 1, 2] = second[..., 2, 1] = short_b * np.sin(b) * mix_e
        second *= (r * r + q)[..., None, None]
        both = expected[..., :, None] * named[..., None, :]
        cov = second - both - np.swapaxes(both, -1, -2) + named[..., :, None] * named[..., None, :]
        x, y = self._pose.position[..., 0], self._pose.position[..., 1]
        place = [leading(x, r.ndim), leading(y, r.ndim), self._height(r.ndim)]
        return Gaussian(named + np.stack([np.broadcast_to(part, r.shape) for part in place], axis=-1), cov)


def _squares(angle: Array, variance: Array) -> tuple[Array, Array, Array]:
    """Return the means of cos^2, sin^2 and sin cos of a Gaussian angle, (*b) each."""
    shrunk = np.exp(-2 * variance)
    cosine = 0.5 * shrunk * np.cos(2 * angle)
    return 0.5 + cosine, 0.5 - cosine, 0.5 * shrunk * np.sin(2 * angle)
