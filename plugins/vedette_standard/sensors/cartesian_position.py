"""A sensor that reports positions in the plane."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Pose, Sensor, Space, fields
from vedette_standard.sensors.station import POSITION


@final
@frozen
class CartesianPosition(Sensor):
    """z = position + v, v ~ N(0, sigma^2 I): a position in the tracker's own frame, whatever platform it came from."""

    kind: ClassVar[str] = "cartesian_position"
    linear: ClassVar[bool] = True

    sigma: float = fields.quantity("m", "standard deviation per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)

    @property
    def observes(self) -> Space:
        return POSITION

    @property
    def measurement(self) -> Space:
        return POSITION

    def measure(self, x: Array) -> Array:
        """(*b, 2) -> (*b, 2)"""
        return x

    def jacobian(self, x: Array) -> Array:
        """(2, 2)"""
        return np.eye(2)

    def noise(self, x: Array) -> Array:
        """(2, 2)"""
        return self.sigma**2 * np.eye(2)

    def detects(self, x: Array) -> Array:
        """()"""
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        """()"""
        return np.asarray(self.clutter_density)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """(*b, 2) -> (*b, 2), (*b, 2, 2)"""
        cov = self.noise(z) if noise is None else noise
        return Gaussian(z, np.broadcast_to(cov, (*z.shape, 2)))

    def at(self, pose: Pose) -> Sensor:
        """The same: positions are absolute."""
        return self
