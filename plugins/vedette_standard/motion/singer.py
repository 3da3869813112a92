"""Singer's model: an acceleration with exponentially decaying correlation."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_standard.motion.blocks import PerAxis
from vedette_standard.motion.forgetting import shares


@final
@frozen
class Singer(PerAxis):
    """Acceleration a with a' = -a/tau + white noise, stationary standard deviation `sigma_accel`, exactly discretised.

    Per axis, u = T/tau, e = exp(-u): F = [1 T T^2 (u-1+e)/u^2; 0 1 T (1-e)/u; 0 0 e],
    Q = (2 sigma_accel^2 / tau) * integral over [0, T] of g g', g(s) the last column of F(s).
    Towards tau -> infinity it is constant acceleration, towards tau -> 0 constant velocity with q = 2 sigma_accel^2 tau.
    Singer, Estimating Optimal Tracking Filter Performance for Manned Maneuvering Targets, IEEE T-AES 6, 1970.

    >>> import numpy as np
    >>> from scipy.linalg import expm
    >>> model, q = Singer(tau=8.0, sigma_accel=3.0, axes=("x",)), 18.0 / 8.0
    >>> A = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / 8.0]])
    >>> M = expm(2.0 * np.block([[-A, np.diag([0.0, 0.0, q])], [np.zeros((3, 3)), A.T]]))  # x' = A x + w, by Van Loan
    >>> F, x = M[3:, 3:].T, np.array([100.0, 5.0, 0.5])
    >>> np.allclose(model.jacobian(x, 2.0), F), np.allclose(model.noise(x, 2.0), F @ M[:3, 3:])
    (True, True)
    >>> np.allclose(model.move(x, 2.0), F @ x)
    True
    """

    kind: ClassVar[str] = "singer"
    divisible: ClassVar[bool] = True
    derivatives: ClassVar[int] = 3

    tau: float = fields.quantity("s", "time after which an acceleration is down to 1/e", above=0)
    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the acceleration, per axis", above=0)

    def transition(self, dt: float) -> Array:
        u = dt / self.tau
        a, b, *_ = shares(u)
        return np.array([[1.0, dt, dt**2 * b], [0.0, 1.0, dt * a], [0.0, 0.0, math.exp(-u)]])

    def covariance(self, dt: float) -> Array:
        u = dt / self.tau
        a, b, c, velocity, mixed, position = shares(u)
        q = 2 * self.sigma_accel**2 * u
        return np.array(
            [
                [q * dt**4 * position, q * dt**3 * b * b / 2, q * dt**2 * mixed],
                [q * dt**3 * b * b / 2, q * dt**2 * velocity, q * dt * a * a / 2],
                [q * dt**2 * mixed, q * dt * a * a / 2, q * c],
            ]
        )
