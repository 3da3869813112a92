"""Nearly constant acceleration that changes by a random amount at every step."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette_standard.motion.blocks import Block, PerAxis, free_flight


@final
@frozen
class WienerAccelerationPiecewise(PerAxis):
    """Discrete Wiener acceleration: per axis F = [1 T T^2/2; 0 1 T; 0 0 1], Q = sigma_change^2 G G', G = [T^2/2; T; 1].

    At the start of every step the acceleration changes by a random amount that does not depend on the step's length, and
    stays constant through it: a step of no time has none, but the noise does not shrink as steps shorten, and two steps do
    not equal one. The continuous Wiener acceleration is `constant_acceleration`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.3.3.

    >>> import numpy as np
    >>> model, T = WienerAccelerationPiecewise(0.3, axes=("x",)), 2.0  # over x, vx, ax
    >>> model.move(np.array([100.0, 5.0, 0.5]), T).tolist()
    [111.0, 6.0, 0.5]
    >>> G = np.array([T**2 / 2.0, T, 1.0])
    >>> np.allclose(model.noise(np.zeros(3), T), 0.09 * np.outer(G, G)), model.divisible
    (True, False)
    >>> float(np.sum(model.noise(np.zeros(3), 0.0)))
    0.0
    """

    kind: ClassVar[str] = "wiener_acceleration_piecewise"
    derivatives: ClassVar[int] = 3

    sigma_change: float = fields.quantity(
        "m/s^2", "standard deviation of the acceleration's change at each step, per axis", above=0
    )

    def transition(self, dt: float) -> Block:
        return free_flight(3, dt)

    def covariance(self, dt: float) -> Block:
        gain = self.sigma_change * np.array([dt**2 / 2, dt, float(dt > 0)])
        return np.outer(gain, gain)
