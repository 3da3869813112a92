"""A coordinated turn whose rate is estimated, under accelerations that are held through each step."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, Twin, fields, kernels
from vedette_standard import compiled
from vedette_standard.motion.coordinated_turn import CoordinatedTurn


def _arc(self: CoordinatedTurnPiecewise) -> CoordinatedTurn:
    return CoordinatedTurn(self.sigma_accel, self.sigma_turn_accel)


@final
@frozen
class CoordinatedTurnPiecewise(MotionModel):
    """The arc of `coordinated_turn` with piecewise-constant noise: Q = G diag(sa^2, sa^2, sw^2) G', G = [T^2/2; T] per axis.

    The turn rate gains sw T in a step. Accelerations are drawn at every step and held through it, so the meaning of both
    deviations depends on the step length, and two steps do not equal one: for scans at unequal intervals, use
    `coordinated_turn`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 11.7.1.

    >>> import numpy as np
    >>> model, T, w, v = CoordinatedTurnPiecewise(0.3, 0.02), 3.0, 0.2, 5.0 - 3.0j  # over x, y, vx, vy, turn_rate
    >>> at, turned = (np.exp(1j * w * T) - 1.0) / (1j * w) * v, np.exp(1j * w * T) * v  # the arc, in complex numbers
    >>> x, G = np.array([100.0, 50.0, v.real, v.imag, w]), np.array([T**2 / 2.0, T])
    >>> np.allclose(model.move(x, T), [100.0 + at.real, 50.0 + at.imag, turned.real, turned.imag, w])
    True
    >>> Q = np.kron(0.09 * np.outer(G, G), np.eye(2))
    >>> np.allclose(model.noise(x, T)[:4, :4], Q), np.allclose(model.noise(x, T)[4], [0.0, 0.0, 0.0, 0.0, 0.0004 * T**2])
    (True, True)
    """

    kind: ClassVar[str] = "coordinated_turn_piecewise"

    sigma_accel: float = fields.quantity("m/s^2", "standard deviation of the acceleration held in a step, per axis", above=0)
    sigma_turn_accel: float = fields.quantity(
        "rad/s^2", "standard deviation of the turn rate's acceleration held in a step", above=0
    )
    _turn: CoordinatedTurn = field(init=False, repr=False, eq=False, default=Factory(_arc, takes_self=True))

    @property
    def state(self) -> Space:
        return self._turn.state

    @property
    def twin(self) -> Twin | None:
        return compiled.twin(self.kind, self.sigma_accel, self.sigma_turn_accel)

    def move(self, x: Array, dt: float) -> Array:
        return self._turn.move(x, dt)

    def jacobian(self, x: Array, dt: float) -> Array:
        return self._turn.jacobian(x, dt)

    def noise(self, x: Array, dt: float) -> Array:
        gain = self.sigma_accel * np.array([dt**2 / 2, dt])
        Q = np.zeros((5, 5))
        Q[:4, :4] = kernels.over_axes(np.outer(gain, gain), 2)
        Q[4, 4] = (self.sigma_turn_accel * dt) ** 2
        return Q
