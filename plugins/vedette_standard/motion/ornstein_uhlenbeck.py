"""A velocity with exponentially decaying correlation."""

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
class OrnsteinUhlenbeck(PerAxis):
    """Velocity v with v' = -v/tau + white noise, stationary standard deviation `sigma_speed`, exactly discretised.

    Per axis, u = T/tau, e = exp(-u), a = (1-e)/u, c = (1-e^2)/(2u): F = [1 T a; 0 e],
    Q = 2 sigma_speed^2 u [T^2 (1-2a+c)/u^2, T a^2/2; T a^2/2, c]. For what moves about one place, or drifts to and fro:
    the velocity's variance stays bounded, unlike that of constant velocity, which is the limit tau -> infinity.
    Uhlenbeck, Ornstein, On the Theory of the Brownian Motion, Physical Review 36, 1930.

    >>> import numpy as np
    >>> from scipy.linalg import expm
    >>> model, q = OrnsteinUhlenbeck(tau=8.0, sigma_speed=3.0, axes=("x",)), 18.0 / 8.0
    >>> A = np.array([[0.0, 1.0], [0.0, -1.0 / 8.0]])  # x' = A x + w; the integral by Van Loan
    >>> M = expm(2.0 * np.block([[-A, np.diag([0.0, q])], [np.zeros((2, 2)), A.T]]))
    >>> F = M[2:, 2:].T
    >>> np.allclose(model.jacobian(np.zeros(2), 2.0), F), np.allclose(model.noise(np.zeros(2), 2.0), F @ M[:2, 2:])
    (True, True)
    >>> np.allclose(model.move(np.array([100.0, 5.0]), 2.0), [100.0 + 40.0 * (1.0 - np.exp(-0.25)), 5.0 * np.exp(-0.25)])
    True
    """

    kind: ClassVar[str] = "ornstein_uhlenbeck"
    divisible: ClassVar[bool] = True
    derivatives: ClassVar[int] = 2

    tau: float = fields.quantity("s", "time after which a velocity is down to 1/e", above=0)
    sigma_speed: float = fields.quantity("m/s", "standard deviation of the velocity, per axis", above=0)

    def transition(self, dt: float) -> Array:
        u = dt / self.tau
        return np.array([[1.0, dt * shares(u)[0]], [0.0, math.exp(-u)]])

    def covariance(self, dt: float) -> Array:
        u = dt / self.tau
        a, _, c, velocity, *_ = shares(u)
        q = 2 * self.sigma_speed**2 * u
        return np.array([[q * dt**2 * velocity, q * dt * a * a / 2], [q * dt * a * a / 2, q * c]])
