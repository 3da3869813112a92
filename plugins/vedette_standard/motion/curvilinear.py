"""Curved motion under tangential and normal acceleration."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields, kernels
from vedette_standard.motion.blocks import white_jerk

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s", a_tangential="m/s^2", a_normal="m/s^2")
_SLOW = 1e-2
"""Speed in m/s below which accelerations lose their direction."""
_STAND = -0.999
"""A braking target stops once it has lost this fraction of its speed."""
_NOTHING = 1e-150
"""Below this a quotient is at its limit of 1, and numpy may overflow on the way."""


@final
@frozen
class Curvilinear(MotionModel):
    """Speed s and course c under constant accelerations along the path and across it: s' = a_t, c' = a_n / s; moved exactly.

    With the velocity as a complex number v, l = log(1 + a_t T/s), t = l s/a_t / s and w = (2 a_t + i a_n) t: the velocity
    becomes v exp(w - l), and the position gains v s t (exp(w) - 1)/w. Circles (a_t = 0), straight lines (a_n = 0) and
    spirals are included. s = sqrt(|v|^2 + (1 cm/s)^2), as a target at rest has no direction to turn from.
    Q is that of white-noise jerk along the path and across it, in the direction at the start of the step, whatever the
    turn within it: two steps do not equal one. Both deviations are roots of the jerk's spectral
    density: what the acceleration gains in 1 s, growing with the square root of time.
    Best, Norton, A New Model and Efficient Tracker for a Target with Curvilinear Motion, IEEE T-AES 33, 1997.
    """

    kind: ClassVar[str] = "curvilinear"

    sigma_tangential: float = fields.quantity(
        "m/s^2.5", "deviation of the acceleration gained along the path in 1 s", above=0
    )
    sigma_normal: float = fields.quantity("m/s^2.5", "deviation of that gained to the left of it in 1 s", above=0)

    @property
    def state(self) -> Space:
        return _STATE

    def move(self, x: Array, dt: float) -> Array:
        """Return the state `dt` s later: (*b, 6) -> (*b, 6)."""
        speed = np.sqrt(x[..., 2] ** 2 + x[..., 3] ** 2 + _SLOW**2)
        gained = np.maximum(x[..., 4] * dt / speed, _STAND)
        braking = x[..., 4] * dt / speed < _STAND
        log = np.log1p(gained)
        # log / gained tends to 1; a target that stops has moved for as long as the braking took.
        elapsed = np.where(braking, gained * speed / np.where(braking, x[..., 4], 1.0), dt)
        share = np.divide(log, gained, out=np.ones_like(log), where=np.abs(gained) > _NOTHING)
        time = elapsed * share / speed
        w = (2 * x[..., 4] + 1j * x[..., 5]) * time
        chord = np.divide(np.expm1(w), w, out=np.ones_like(w), where=np.abs(w) > _NOTHING)
        v = x[..., 2] + 1j * x[..., 3]
        step, after = v * elapsed * share * chord, v * np.exp(w - log)
        moved = x.copy()
        moved[..., 0] += step.real
        moved[..., 1] += step.imag
        moved[..., 2], moved[..., 3] = after.real, after.imag
        return moved

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q: (*b, 6) -> (*b, 6, 6)."""
        course = np.arctan2(x[..., 3], x[..., 2])
        frame = np.stack([np.cos(course), -np.sin(course), np.sin(course), np.cos(course)], axis=-1)
        turn = np.zeros((*course.shape, 6, 6))
        turn[..., :2, :2] = turn[..., 2:4, 2:4] = frame.reshape(*course.shape, 2, 2)
        turn[..., 4:, 4:] = np.eye(2)
        own = np.zeros((6, 6))
        own[::2, ::2], own[1::2, 1::2] = white_jerk(self.sigma_tangential, dt), white_jerk(self.sigma_normal, dt)
        Q = turn @ own @ np.swapaxes(turn, -1, -2)
        return kernels.symmetric(Q)
