"""A turn in space, in any plane, whose rate is estimated."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, Twin, fields, kernels
from vedette_standard import compiled
from vedette_standard.motion.blocks import white_acceleration

_STATE = Space.of(
    x="m", y="m", z="m", vx="m/s", vy="m/s", vz="m/s", turn_rate_x="rad/s", turn_rate_y="rad/s", turn_rate_z="rad/s"
)
_POWERS = np.arange(13)
_SERIES = np.array([[(-1) ** k / math.factorial(2 * k + i) for k in range(13)] for i in (1, 2, 3)])
"""Coefficients of A^(2k) in sin(A)/A, (1 - cos A)/A^2 and (A - sin A)/A^3; below A = 1 what is left out is under 1e-27."""


def _shares(square: Array) -> Array:
    """Return sin(A)/A, (1 - cos A)/A^2, (A - sin A)/A^3 of A^2 (*b): (3, *b)."""
    small = square < 1.0
    angle = np.sqrt(np.where(small, 1.0, square))
    half = 2 * (np.sin(angle / 2) / angle) ** 2
    closed = np.stack([np.sin(angle) / angle, half, (1 - np.sin(angle) / angle) / angle**2])
    series = np.tensordot(_SERIES, np.where(small, square, 0.0) ** _POWERS.reshape(-1, *(1,) * square.ndim), 1)
    return np.where(small, series, closed)


def _slopes(square: Array, shares: Array) -> Array:
    """Return the derivatives of `shares` by A, over A: (3, *b)."""
    small = square < 1.0
    safe = np.where(small, 1.0, square)
    closed = np.stack([1 - square * shares[1] - shares[0], shares[0] - 2 * shares[1], shares[1] - 3 * shares[2]]) / safe
    powers = np.where(small, square, 0.0) ** _POWERS[:-1].reshape(-1, *(1,) * square.ndim)
    series = np.tensordot(2 * _POWERS[1:] * _SERIES[:, 1:], powers, 1)
    return np.where(small, series, closed)


def _cross(w: Array) -> Array:
    """Return the matrix (*b, 3, 3) of w x."""
    K = np.zeros((*w.shape, 3))
    K[..., 2, 1], K[..., 0, 2], K[..., 1, 0] = w[..., 0], w[..., 1], w[..., 2]
    return K - np.swapaxes(K, -1, -2)


@final
@frozen
class CoordinatedTurn3d(MotionModel):
    """v' = W x v with a constant vector W of turn rates, and white noise: the velocity turns about W, moved exactly.

    With K = [W x] T and A = |W| T: v becomes (I + sin(A)/A K + (1 - cos A)/A^2 K^2) v, and the position gains
    T (I + (1 - cos A)/A^2 K + (A - sin A)/A^3 K^2) v. With W upright it is the coordinated turn in the plane; the part of W
    along v turns nothing and is a random walk. Q is that of constant velocity over x to vz and sigma_turn_rate^2 T for the
    rates, whatever the state, so two steps do not equal one. Both deviations are those of `coordinated_turn`.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003.

    >>> from scipy.linalg import expm
    >>> model, T, v, W = CoordinatedTurn3d(0.3, 0.02), 3.0, np.array([5.0, -3.0, 2.0]), np.array([0.1, -0.2, 0.3])
    >>> cross = np.array([[0.0, -0.3, -0.2], [0.3, 0.0, -0.1], [0.2, 0.1, 0.0]])  # W x
    >>> flow = expm(T * np.block([[np.zeros((3, 3)), np.eye(3)], [np.zeros((3, 3)), cross]]))
    >>> x = np.array([100.0, 50.0, 9.0, *v, *W])
    >>> np.allclose(model.move(x, T)[:6], flow @ x[:6]), np.allclose(model.move(x, T)[6:], W)
    (True, True)
    >>> by_differences = [(model.move(x + d, T) - model.move(x - d, T)) / 2e-6 for d in 1e-6 * np.eye(9)]
    >>> np.allclose(model.jacobian(x, T), np.transpose(by_differences), atol=1e-6)
    True
    >>> Q, own = model.noise(x, T), 0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> np.allclose(Q[:6, :6], np.kron(own, np.eye(3))), np.allclose(Q[6:], np.eye(9)[6:] * 0.0004 * T)
    (True, True)
    """

    kind: ClassVar[str] = "coordinated_turn_3d"
    state: ClassVar[Space] = _STATE

    sigma_accel: float = fields.quantity("m/s^1.5", "standard deviation of the velocity gained in 1 s, per axis", above=0)
    sigma_turn_rate: float = fields.quantity(
        "rad/s^1.5", "standard deviation of the turn rate gained in 1 s, per axis", above=0
    )

    @property
    def twin(self) -> Twin | None:
        return compiled.twin(self.kind, self.sigma_accel, self.sigma_turn_rate)

    def move(self, x: Array, dt: float) -> Array:
        w, v = x[..., 6:] * dt, x[..., 3:6]
        a, b, c = _shares(np.sum(w * w, axis=-1))[..., None]
        once = np.cross(w, v)
        twice = np.cross(w, once)
        moved = x.copy()
        moved[..., :3] += dt * (v + b * once + c * twice)
        moved[..., 3:6] += a * once + b * twice
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        w, v = x[..., 6:] * dt, x[..., 3:6]
        square = np.sum(w * w, axis=-1)
        shares = _shares(square)
        a, b, c = shares[..., None, None]
        da, db, dc = _slopes(square, shares)[..., None, None]
        K = _cross(w)
        once, twice = np.cross(w, v)[..., None], np.cross(w, np.cross(w, v))[..., None]
        turned, turned_twice = -_cross(v), -_cross(once[..., 0]) - K @ _cross(v)
        along = w[..., None, :]
        F = np.zeros((*x.shape, 9))
        F[..., range(9), range(9)] = 1.0
        F[..., :3, 3:6] = dt * (np.eye(3) + b * K + c * K @ K)
        F[..., 3:6, 3:6] += a * K + b * K @ K
        F[..., :3, 6:] = dt**2 * (b * turned + c * turned_twice + (db * once + dc * twice) @ along)
        F[..., 3:6, 6:] = dt * (a * turned + b * turned_twice + (da * once + db * twice) @ along)
        return F

    def noise(self, x: Array, dt: float) -> Array:
        Q = np.zeros((9, 9))
        Q[:6, :6] = kernels.over_axes(white_acceleration(self.sigma_accel, dt), 3)
        Q[6:, 6:] = self.sigma_turn_rate**2 * dt * np.eye(3)
        return Q
