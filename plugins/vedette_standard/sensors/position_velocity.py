"""A sensor that measures positions and velocities in the plane: a satellite receiver, AIS."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_standard.sensors.viewed import ViewedSensor

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@final
@frozen
class PositionVelocity(ViewedSensor):
    """z = (x, y, vx, vy) + v, v ~ N(0, diag(sigma^2, sigma^2, sigma_speed^2, sigma_speed^2)), in the tracker's own frame.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.2.
    """

    kind: ClassVar[str] = "position_velocity"

    sigma: float = fields.quantity("m", "standard deviation of the position per axis", above=0)
    sigma_speed: float = fields.quantity("m/s", "standard deviation of the velocity per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity(
        "s^2/m^4", "false returns per scan, area and area of velocities", default=0.0, at_least=0
    )

    @property
    def observes(self) -> Space:
        return _STATE

    def noise(self, x: Array) -> Array:
        """Return R (4, 4)."""
        return np.diag([self.sigma**2, self.sigma**2, self.sigma_speed**2, self.sigma_speed**2])
