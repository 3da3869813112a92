"""Nearly constant acceleration under a jerk that is constant through each step."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette_standard.motion.blocks import Block, PerAxis, free_flight


@final
@frozen
class ConstantAccelerationPiecewise(PerAxis):
    """Piecewise-constant white jerk: per axis F = [1 T T^2/2; 0 1 T; 0 0 1], Q = sigma_jerk^2 G G', G = [T^3/6; T^2/2; T].

    The jerk is drawn at every step and held through it, so two steps do not equal one: for scans at unequal
    intervals, use `constant_acceleration`.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003.

    >>> import numpy as np
    >>> model, T = ConstantAccelerationPiecewise(0.3, axes=("x",)), 2.0  # over x, vx, ax
    >>> model.move(np.array([100.0, 5.0, 0.5]), T).tolist()
    [111.0, 6.0, 0.5]
    >>> G = np.array([T**3 / 6.0, T**2 / 2.0, T])
    >>> np.allclose(model.noise(np.zeros(3), T), 0.09 * np.outer(G, G)), model.divisible
    (True, False)
    """

    kind: ClassVar[str] = "constant_acceleration_piecewise"
    derivatives: ClassVar[int] = 3

    sigma_jerk: float = fields.quantity("m/s^3", "standard deviation of the jerk held in a step, per axis", above=0)

    def transition(self, dt: float) -> Block:
        return free_flight(3, dt)

    def covariance(self, dt: float) -> Block:
        gain = self.sigma_jerk * np.array([dt**3 / 6, dt**2 / 2, dt])
        return np.outer(gain, gain)
