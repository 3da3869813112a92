"""Singer's model: an acceleration that is forgotten."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.motion.blocks import POSITION_VELOCITY_ACCELERATION, planar

_ORDERS = np.arange(26)
_SERIES = np.array(
    [
        [
            1 / math.factorial(i + 1),
            1 / math.factorial(i + 2),
            2**i / math.factorial(i + 1),
            (2 ** (i + 2) - 2) / math.factorial(i + 3),
            (2 ** (i + 2) - i - 3) / math.factorial(i + 3),
            (2 ** (i + 4) - 2 * i - 10) / math.factorial(i + 5),
        ]
        for i in range(len(_ORDERS))
    ]
)
"""Coefficients of (-u)^i of the six functions in `_shares`; at u = 1 what is left out is below 1e-17."""


def _shares(u: float) -> tuple[float, ...]:
    """The parts of F and Q that depend on u = T/tau >= 0 alone, each finite at 0; by series below u = 1, where they cancel.

    With e = exp(-u): the gains a = (1 - e)/u of velocity and b = (1 - a)/u of position, and of the variances the shares
    c = (1 - e^2)/(2u), (1 - 2a + c)/u^2 of velocity, (c - e)/u^2 of position with acceleration, and
    (u^2/3 - u + 1 + c - 2e)/u^4 of position.
    """
    if u < 1.0:
        return tuple(((-u) ** _ORDERS @ _SERIES).tolist())
    e = math.exp(-u)
    a, c = (1 - e) / u, (1 - e * e) / (2 * u)
    return a, (1 - a) / u, c, (1 - 2 * a + c) / u / u, (c - e) / u / u, (((1 + c - 2 * e) / u - 1) / u + 1 / 3) / u / u


@final
@frozen
class Singer(MotionModel):
    """Acceleration a with a' = -a/tau + white noise, stationary standard deviation `sigma_accel`, exactly discretised.

    Per axis, u = T/tau, e = exp(-u): F = [1 T T^2 (u-1+e)/u^2; 0 1 T (1-e)/u; 0 0 e],
    Q = (2 sigma_accel^2 / tau) * integral over [0, T] of g g', g(s) the last column of F(s).
    Towards tau -> infinity it is constant acceleration, towards tau -> 0 constant velocity with q = 2 sigma_accel^2 tau.
    Singer, Estimating Optimal Tracking Filter Performance for Manned Maneuvering Targets, IEEE T-AES 6, 1970.
    """

    kind: ClassVar[str] = "singer"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True

    tau: float = fields.quantity("s", "time after which an acceleration is down to 1/e", above=0)
    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the acceleration, per axis", above=0)

    @property
    def state(self) -> Space:
        return POSITION_VELOCITY_ACCELERATION

    def move(self, x: Array, dt: float) -> Array:
        """(*b, 6) -> (*b, 6)"""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        u = dt / self.tau
        a, b, *_ = _shares(u)
        return planar(np.array([[1.0, dt, dt**2 * b], [0.0, 1.0, dt * a], [0.0, 0.0, math.exp(-u)]]))

    def noise(self, x: Array, dt: float) -> Array:
        """(6, 6)"""
        u = dt / self.tau
        a, b, c, velocity, mixed, position = _shares(u)
        q = 2 * self.sigma_accel**2 * u
        block = [
            [q * dt**4 * position, q * dt**3 * b * b / 2, q * dt**2 * mixed],
            [q * dt**3 * b * b / 2, q * dt**2 * velocity, q * dt * a * a / 2],
            [q * dt**2 * mixed, q * dt * a * a / 2, q * c],
        ]
        return planar(np.array(block))
