"""Nearly constant acceleration."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette_standard.motion.blocks import Block, PerAxis, free_flight, white_jerk


@final
@frozen
class ConstantAcceleration(PerAxis):
    """White-noise jerk, exactly discretised: the acceleration is a Wiener process.

    Per axis F = [1 T T^2/2; 0 1 T; 0 0 1], Q = q [T^5/20 T^4/8 T^3/6; T^4/8 T^3/3 T^2/2; T^3/6 T^2/2 T].
    `sigma_jerk` is the root of the jerk's spectral density, q = sigma_jerk^2 in m^2/s^5: in T s the acceleration
    changes by sigma_jerk sqrt(T), one standard deviation. A config may also give it in m/s^3, with the same number: the
    change in 1 s.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.3.

    >>> import numpy as np
    >>> model, T = ConstantAcceleration(0.3, axes=("x",)), 2.0  # over x, vx, ax
    >>> model.move(np.array([100.0, 5.0, 0.5]), T).tolist()
    [111.0, 6.0, 0.5]
    >>> Q = [[T**5 / 20.0, T**4 / 8.0, T**3 / 6.0], [T**4 / 8.0, T**3 / 3.0, T**2 / 2.0], [T**3 / 6.0, T**2 / 2.0, T]]
    >>> np.allclose(model.noise(np.zeros(3), T), 0.09 * np.array(Q)), model.divisible
    (True, True)
    >>> ConstantAcceleration(0.3).state.names
    ('x', 'y', 'vx', 'vy', 'ax', 'ay')
    """

    kind: ClassVar[str] = "constant_acceleration"
    abbreviations: ClassVar[tuple[str, ...]] = ("nca",)
    divisible: ClassVar[bool] = True
    derivatives: ClassVar[int] = 3

    sigma_jerk: float = fields.quantity("m/s^2.5", "standard deviation of the acceleration gained in 1 s, per axis", above=0)

    def transition(self, dt: float) -> Block:
        return free_flight(3, dt)

    def covariance(self, dt: float) -> Block:
        return white_jerk(self.sigma_jerk, dt)
