"""How a box moves and grows in an image."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_boxes.sensors.box import LEAST

_STATE = Space.of(x="px", y="px", vx="px/s", vy="px/s", width="px", height="px")


@final
@frozen
class BoxVelocity(MotionModel):
    """Constant velocity of the middle, with an acceleration noise in heights of the box; each side wanders by parts of it.

    Per axis F = [1 T; 0 1], Q = (a h)^2 [T^3/3 T^2/2; T^2/2 T], a = `sigma_accel`, h the height: what is near moves fast in
    the image, and is large. A side s gains the variance (g s)^2 T, g = `sigma_growth`.
    Wojke, Bewley, Paulus, Simple Online and Realtime Tracking with a Deep Association Metric, ICIP 2017 (noise by height).

    >>> model, T = BoxVelocity(sigma_accel=0.5, sigma_growth=0.2), 2.0
    >>> x = np.array([100.0, 50.0, 5.0, -3.0, 20.0, 40.0])  # width 20, height 40 px
    >>> model.move(x, T).tolist()
    [110.0, 44.0, 5.0, -3.0, 20.0, 40.0]
    >>> Q, block = model.noise(x, T), 0.25 * 40.0**2 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]])
    >>> np.allclose(Q[:4, :4], np.kron(block, np.eye(2))), np.allclose(np.diag(Q)[4:], [0.04 * 400.0 * T, 0.04 * 1600.0 * T])
    (True, True)
    >>> mean = model.mean_noise(x, np.diag([1.0, 1.0, 1.0, 1.0, 9.0, 100.0]), T)  # of the mean squares of the sides
    >>> np.allclose(mean[0, 0] / Q[0, 0], 1700.0 / 1600.0), np.allclose(mean[4, 4], 0.04 * 409.0 * T)
    (True, True)
    """

    kind: ClassVar[str] = "box_velocity"
    state: ClassVar[Space] = _STATE

    sigma_accel: float = fields.quantity(
        "1/s^1.5", "standard deviation of the velocity gained in 1 s, in heights", default=0.5, above=0
    )
    sigma_growth: float = fields.quantity(
        "1/s^0.5", "standard deviation of a side's change in 1 s, as a part of it", default=0.2, above=0
    )

    def move(self, x: Array, dt: float) -> Array:
        """Return the box `dt` later: (*b, 6) -> (*b, 6)."""
        moved = x.copy()
        moved[..., :2] += dt * x[..., 2:4]
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        F = np.eye(6)
        F[0, 2] = F[1, 3] = dt
        return F

    def noise(self, x: Array, dt: float) -> Array:
        return self._of_squares(np.maximum(x[..., 4:], LEAST) ** 2, dt)

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        """Return the mean of Q over a belief, by the mean squares of the sides: (*b, 6), (*b, 6, 6) -> (*b, 6, 6)."""
        return self._of_squares(np.maximum(x[..., 4:], LEAST) ** 2 + np.diagonal(cov, axis1=-2, axis2=-1)[..., 4:], dt)

    def _of_squares(self, squares: Array, dt: float) -> Array:
        """Return Q for the squares of the sides: (*b, 2) -> (*b, 6, 6)."""
        Q = np.zeros((*squares.shape[:-1], 6, 6))
        q = self.sigma_accel**2 * squares[..., 1]
        for axis in (0, 1):
            Q[..., axis, axis] = q * dt**3 / 3
            Q[..., axis, 2 + axis] = Q[..., 2 + axis, axis] = q * dt**2 / 2
            Q[..., 2 + axis, 2 + axis] = q * dt
            Q[..., 4 + axis, 4 + axis] = self.sigma_growth**2 * squares[..., axis] * dt
        return Q
