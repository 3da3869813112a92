"""Nearly constant velocity in the plane."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.motion.blocks import POSITION_VELOCITY, planar, white_acceleration


@final
@frozen
class ConstantVelocity(MotionModel):
    """White-noise acceleration, exactly discretised: per axis F = [1 T; 0 1], Q = q [T^3/3 T^2/2; T^2/2 T].

    `sigma_accel` is the acceleration's effect over one second: q = sigma_accel^2 * 1 s, in m^2/s^3.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.2.
    """

    kind: ClassVar[str] = "constant_velocity"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the velocity gained in 1 s, per axis", above=0)

    @property
    def state(self) -> Space:
        return POSITION_VELOCITY

    def move(self, x: Array, dt: float) -> Array:
        """(*b, 4) -> (*b, 4)"""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """(4, 4)"""
        return planar(np.array([[1.0, dt], [0.0, 1.0]]))

    def noise(self, x: Array, dt: float) -> Array:
        """(4, 4)"""
        return white_acceleration(self.sigma_accel, dt)
