"""Nearly constant velocity."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette_standard.motion.blocks import Block, PerAxis, free_flight, white_acceleration


@final
@frozen
class ConstantVelocity(PerAxis):
    """White-noise acceleration, exactly discretised: per axis F = [1 T; 0 1], Q = q [T^3/3 T^2/2; T^2/2 T].

    `sigma_accel` is the root of the acceleration's spectral density, q = sigma_accel^2 in m^2/s^3: in T s the velocity
    changes by sigma_accel sqrt(T), one standard deviation. A config may also give it in m/s^2, with the same number: the
    change in 1 s.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.2.

    >>> import numpy as np
    >>> model, T = ConstantVelocity(0.3), 2.0  # over x, y, vx, vy
    >>> model.move(np.array([100.0, 50.0, 5.0, -3.0]), T).tolist()
    [110.0, 44.0, 5.0, -3.0]
    >>> F, Q = np.array([[1.0, T], [0.0, 1.0]]), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> np.allclose(model.jacobian(np.zeros(4), T), np.kron(F, np.eye(2)))
    True
    >>> np.allclose(model.noise(np.zeros(4), T), np.kron(Q, np.eye(2))), ConstantVelocity(0.3, axes=("z",)).state.names
    (True, ('z', 'vz'))
    """

    kind: ClassVar[str] = "constant_velocity"
    abbreviations: ClassVar[tuple[str, ...]] = ("ncv",)
    divisible: ClassVar[bool] = True
    derivatives: ClassVar[int] = 2

    sigma_accel: float = fields.quantity("m/s^1.5", "standard deviation of the velocity gained in 1 s, per axis", above=0)

    def transition(self, dt: float) -> Block:
        return free_flight(2, dt)

    def covariance(self, dt: float) -> Block:
        return white_acceleration(self.sigma_accel, dt)
