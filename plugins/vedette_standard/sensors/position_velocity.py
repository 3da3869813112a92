"""A sensor that reports positions and velocities in the plane: a satellite receiver, AIS."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Pose, Sensor, Space, fields

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@final
@frozen
class PositionVelocity(Sensor):
    """z = (x, y, vx, vy) + v, v ~ N(0, diag(sigma^2, sigma^2, sigma_speed^2, sigma_speed^2)), in the tracker's own frame.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.2.
    """

    kind: ClassVar[str] = "position_velocity"
    linear: ClassVar[bool] = True

    sigma: float = fields.quantity("m", "standard deviation of the position per axis", above=0)
    sigma_speed: float = fields.quantity("m/s", "standard deviation of the velocity per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity(
        "s^2/m^4", "false returns per scan, area and area of velocities", default=0.0, at_least=0
    )

    @property
    def observes(self) -> Space:
        return _STATE

    @property
    def measurement(self) -> Space:
        return _STATE

    def measure(self, x: Array) -> Array:
        """(*b, 4) -> (*b, 4)"""
        return x

    def jacobian(self, x: Array) -> Array:
        """(4, 4)"""
        return np.eye(4)

    def noise(self, x: Array) -> Array:
        """(4, 4)"""
        return np.diag([self.sigma**2, self.sigma**2, self.sigma_speed**2, self.sigma_speed**2])

    def detects(self, x: Array) -> Array:
        """()"""
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        """()"""
        return np.asarray(self.clutter_density)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """(*b, 4) -> (*b, 4), (*b, 4, 4)"""
        cov = self.noise(z) if noise is None else noise
        return Gaussian(z, np.broadcast_to(cov, (*z.shape, 4)))

    def at(self, pose: Pose) -> Sensor:
        """The same: what it reports is absolute."""
        return self
