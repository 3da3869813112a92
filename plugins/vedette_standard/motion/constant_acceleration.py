"""Nearly constant acceleration in the plane."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.motion.blocks import POSITION_VELOCITY_ACCELERATION, planar


@final
@frozen
class ConstantAcceleration(MotionModel):
    """White-noise jerk, exactly discretised: the acceleration is a Wiener process.

    Per axis F = [1 T T^2/2; 0 1 T; 0 0 1], Q = q [T^5/20 T^4/8 T^3/6; T^4/8 T^3/3 T^2/2; T^3/6 T^2/2 T].
    `sigma_jerk` is the jerk's effect over one second: q = sigma_jerk^2 * 1 s, in m^2/s^5.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.3.
    """

    kind: ClassVar[str] = "constant_acceleration"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    sigma_jerk: float = fields.quantity("m/s^3", "standard deviation of the acceleration gained in 1 s, per axis", above=0)

    @property
    def state(self) -> Space:
        return POSITION_VELOCITY_ACCELERATION

    def move(self, x: Array, dt: float) -> Array:
        """(*b, 6) -> (*b, 6)"""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        return planar(np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]]))

    def noise(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        q = self.sigma_jerk**2
        position, mixed, velocity = q * dt**5 / 20, q * dt**4 / 8, q * dt**3
        return planar(
            np.array(
                [
                    [position, mixed, velocity / 6],
                    [mixed, velocity / 3, q * dt**2 / 2],
                    [velocity / 6, q * dt**2 / 2, q * dt],
                ]
            )
        )
