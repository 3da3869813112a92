"""A coordinated turn of known rate."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_standard.motion.blocks import POSITION_VELOCITY
from vedette_standard.motion.turning import Turn


@final
@frozen
class KnownTurn(MotionModel):
    """The velocity turns at a constant rate w and gains white-noise acceleration, exactly discretised: v' = w J v + noise.

    With A = w T, J = [0 -1; 1 0]: position gains T (sin(A)/A I + (1 - cos A)/A J) v, v turns by A, and
    Q_pp = q T^3 2 (A - sin A)/A^3 I, Q_pv = q T^2 ((1 - cos A)/A^2 I - (A - sin A)/A^2 J), Q_vv = q T I.
    q as in constant velocity, which this is at w = 0. Q is the integral over the turning system: two steps equal one.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003.

    >>> import numpy as np
    >>> from scipy.linalg import expm
    >>> model, J, q, I = KnownTurn(turn_rate=0.2, sigma_accel=0.3), np.array([[0.0, -1.0], [1.0, 0.0]]), 0.09, np.eye(2)
    >>> A = np.block([[0.0 * I, I], [0.0 * I, 0.2 * J]])  # x, y, vx, vy
    >>> M = expm(3.0 * np.block([[-A, np.diag([0.0, 0.0, q, q])], [np.zeros((4, 4)), A.T]]))  # the integral by Van Loan
    >>> F, x = M[4:, 4:].T, np.array([100.0, 50.0, 5.0, -3.0])
    >>> np.allclose(model.jacobian(x, 3.0), F), np.allclose(model.noise(x, 3.0), F @ M[:4, 4:])
    (True, True)
    >>> np.allclose(model.move(x, 3.0), F @ x)
    True
    """

    kind: ClassVar[str] = "known_turn"
    divisible: ClassVar[bool] = True
    linear: ClassVar[bool] = True
    state: ClassVar[Space] = POSITION_VELOCITY

    turn_rate: float = fields.quantity("rad/s", "rate of turn, positive from x towards y")
    sigma_accel: float = fields.quantity("m/s^1.5", "standard deviation of the velocity gained in 1 s, per axis", above=0)

    def move(self, x: Array, dt: float) -> Array:
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        turn = Turn.by(self.turn_rate * dt)
        F = np.eye(4)
        F[0, 2] = F[1, 3] = dt * turn.along
        F[1, 2] = dt * turn.across
        F[0, 3] = -F[1, 2]
        F[2, 2] = F[3, 3] = turn.cos_angle
        F[3, 2] = turn.sin_angle
        F[2, 3] = -F[3, 2]
        return F

    def noise(self, x: Array, dt: float) -> Array:
        angle = self.turn_rate * dt
        turn = Turn.by(angle)
        q = self.sigma_accel**2
        Q = np.zeros((4, 4))
        Q[0, 0] = Q[1, 1] = q * dt**3 * 2 * turn.odd
        Q[0, 2] = Q[2, 0] = Q[1, 3] = Q[3, 1] = q * dt**2 * turn.even
        Q[0, 3] = Q[3, 0] = q * dt**2 * angle * turn.odd
        Q[1, 2] = Q[2, 1] = -Q[0, 3]
        Q[2, 2] = Q[3, 3] = q * dt
        return Q
