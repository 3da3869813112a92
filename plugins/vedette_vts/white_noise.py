"""Nearly constant velocity with an acceleration that holds for a whole scan."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@final
@frozen
class DiscreteWhiteNoiseAcceleration(MotionModel):
    """The acceleration is constant from scan to scan and independent between scans: F = [1 T; 0 1], Q = q q' sigma_accel^2
    with q = (T^2/2, T), per axis.

    Unlike white noise it depends on when the scans come: two steps do not make one, and sigma_accel holds for one period.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.3.2.
    """

    kind: ClassVar[str] = "discrete_white_noise_acceleration"
    linear: ClassVar[bool] = True

    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the acceleration during a scan, per axis", above=0)

    @property
    def state(self) -> Space:
        return _STATE

    def move(self, x: Array, dt: float) -> Array:
        """(*b, 4) -> (*b, 4)"""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """(4, 4)"""
        return np.eye(4) + dt * np.eye(4, k=2)

    def noise(self, x: Array, dt: float) -> Array:
        """(4, 4)"""
        gain = self.sigma_accel * np.array([dt**2 / 2, dt])
        return np.kron(np.outer(gain, gain), np.eye(2))
