"""Nearly constant acceleration with a step of it at each scan."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s", ax="m/s^2", ay="m/s^2")


@final
@frozen
class DiscreteWienerProcessAcceleration(MotionModel):
    """The acceleration gains a step at each scan and keeps it: F = [1 T T^2/2; 0 1 T; 0 0 1], Q = q q' sigma_step^2 with
    q = (T^2/2, T, 1), per axis. Over no time there is no step.

    It depends on when the scans come: two steps do not make one, and sigma_step holds for one period.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.3.3.
    """

    kind: ClassVar[str] = "discrete_wiener_process_acceleration"
    linear: ClassVar[bool] = True

    sigma_step: float = fields.quantity(
        "m/s^2", "standard deviation of the acceleration gained in a scan, per axis", above=0
    )

    @property
    def state(self) -> Space:
        return _STATE

    def move(self, x: Array, dt: float) -> Array:
        """(*b, 6) -> (*b, 6)"""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        return np.eye(6) + dt * np.eye(6, k=2) + dt**2 / 2 * np.eye(6, k=4)

    def noise(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        gain = self.sigma_step * np.array([dt**2 / 2, dt, 1.0 if dt > 0 else 0.0])
        return np.kron(np.outer(gain, gain), np.eye(2))
