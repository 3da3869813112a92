"""Nearly constant velocity under an acceleration that is constant through each step."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette_standard.motion.blocks import Block, PerAxis, free_flight


@final
@frozen
class ConstantVelocityPiecewise(PerAxis):
    """Piecewise-constant white acceleration: per axis F = [1 T; 0 1], Q = sigma_accel^2 G G', G = [T^2/2; T].

    The acceleration is drawn at every step and held through it, so the meaning of `sigma_accel` depends on the step length,
    and two steps do not equal one: for scans at unequal intervals, use `constant_velocity`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.3.2.

    >>> import numpy as np
    >>> model, T = ConstantVelocityPiecewise(0.3), 2.0  # over x, y, vx, vy
    >>> model.move(np.array([100.0, 50.0, 5.0, -3.0]), T).tolist()
    [110.0, 44.0, 5.0, -3.0]
    >>> G = np.array([[T**2 / 2.0], [T]])
    >>> np.allclose(model.noise(np.zeros(4), T), np.kron(0.09 * G @ G.T, np.eye(2))), model.divisible
    (True, False)
    """

    kind: ClassVar[str] = "constant_velocity_piecewise"
    abbreviations: ClassVar[tuple[str, ...]] = ("dwna",)
    derivatives: ClassVar[int] = 2

    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the acceleration held in a step, per axis", above=0)

    def transition(self, dt: float) -> Block:
        return free_flight(2, dt)

    def covariance(self, dt: float) -> Block:
        gain = self.sigma_accel * np.array([dt**2 / 2, dt])
        return np.outer(gain, gain)
