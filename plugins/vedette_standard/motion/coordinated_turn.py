"""A coordinated turn whose rate is estimated."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, Twin, fields, kernels
from vedette_standard import compiled
from vedette_standard.motion.blocks import white_acceleration
from vedette_standard.motion.turning import Turn

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s", turn_rate="rad/s")


@final
@frozen
class CoordinatedTurn(MotionModel):
    """Constant speed and turn rate with white noise: the target moves along an arc, exactly.

    With h = turn_rate T / 2 and u = (vx, vy) turned by h: (x, y) += T sin(h)/h u, for the chord of an arc points along its
    middle, and (vx, vy) = u turned by h once more. The position's derivative by turn_rate is T^2/2 ((cos(h) - sin(h)/h)/h u
    + sin(h)/h J u), J = [0 -1; 1 0].
    Q is that of constant velocity over x, y, vx, vy and sigma_turn_rate^2 T for the rate, whatever the state: the noise of
    the velocity is not turned within a step, nor does that of the rate reach the position, so two steps do not equal one.
    Both deviations are roots of spectral densities: velocity and turn rate change by them in 1 s, by sqrt(T) times them in
    T s.
    Li, Jilkov, Survey of Maneuvering Target Tracking, Part I: Dynamic Models, IEEE T-AES 39, 2003.

    >>> import numpy as np
    >>> model, T, w, v = CoordinatedTurn(0.3, 0.02), 3.0, 0.2, 5.0 - 3.0j  # over x, y, vx, vy, turn_rate
    >>> at, turned = (np.exp(1j * w * T) - 1.0) / (1j * w) * v, np.exp(1j * w * T) * v  # the arc, in complex numbers
    >>> x = np.array([100.0, 50.0, v.real, v.imag, w])
    >>> np.allclose(model.move(x, T), [100.0 + at.real, 50.0 + at.imag, turned.real, turned.imag, w])
    True
    >>> step = 1e-6 * np.eye(5)
    >>> by_differences = [(model.move(x + d, T) - model.move(x - d, T)) / 2e-6 for d in step]
    >>> np.allclose(model.jacobian(x, T), np.transpose(by_differences), atol=1e-6)
    True
    >>> Q = np.kron(0.09 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]]), np.eye(2))
    >>> np.allclose(model.noise(x, T)[:4, :4], Q), np.allclose(model.noise(x, T)[4], [0.0, 0.0, 0.0, 0.0, 0.0004 * T])
    (True, True)
    """

    kind: ClassVar[str] = "coordinated_turn"
    state: ClassVar[Space] = _STATE

    sigma_accel: float = fields.quantity("m/s^1.5", "standard deviation of the velocity gained in 1 s, per axis", above=0)
    sigma_turn_rate: float = fields.quantity("rad/s^1.5", "standard deviation of the turn rate gained in 1 s", above=0)

    @property
    def twin(self) -> Twin | None:
        return compiled.twin(self.kind, self.sigma_accel, self.sigma_turn_rate)

    def move(self, x: Array, dt: float) -> Array:
        turn = Turn.by(x[..., 4] * dt)
        ux, uy = turn.halfway(x[..., 2], x[..., 3])
        chord = dt * turn.sinc
        moved = x.copy()
        moved[..., 0] += chord * ux
        moved[..., 1] += chord * uy
        moved[..., 2], moved[..., 3] = turn.halfway(ux, uy)
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        turn = Turn.by(x[..., 4] * dt)
        ux, uy = turn.halfway(x[..., 2], x[..., 3])
        vx, vy = turn.halfway(ux, uy)
        stretch = turn.half * turn.rho
        F = np.zeros((*x.shape, 5))
        F[..., 0, 0] = F[..., 1, 1] = F[..., 4, 4] = 1.0
        F[..., 0, 2] = F[..., 1, 3] = dt * turn.along
        F[..., 1, 2] = dt * turn.across
        F[..., 0, 3] = -F[..., 1, 2]
        F[..., 2, 2] = F[..., 3, 3] = turn.cos_angle
        F[..., 3, 2] = turn.sin_angle
        F[..., 2, 3] = -F[..., 3, 2]
        F[..., 0, 4] = dt**2 / 2 * (stretch * ux - turn.sinc * uy)
        F[..., 1, 4] = dt**2 / 2 * (stretch * uy + turn.sinc * ux)
        F[..., 2, 4] = -dt * vy
        F[..., 3, 4] = dt * vx
        return F

    def noise(self, x: Array, dt: float) -> Array:
        Q = np.zeros((5, 5))
        Q[:4, :4] = kernels.over_axes(white_acceleration(self.sigma_accel, dt), 2)
        Q[4, 4] = self.sigma_turn_rate**2 * dt
        return Q
