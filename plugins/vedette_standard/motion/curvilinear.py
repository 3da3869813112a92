"""Curved motion under tangential and normal acceleration."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen
from numpy.polynomial.polynomial import polyder, polyval

from vedette import Array, MotionModel, Space, Twin, fields, kernels
from vedette_standard import compiled
from vedette_standard.motion.blocks import white_jerk

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s", a_tangential="m/s^2", a_normal="m/s^2")
_SLOW = 1e-2
"""Speed in m/s below which accelerations lose their direction."""
_STAND = -0.999
"""A braking target stops once it has lost this fraction of its speed."""
_LOG = (-1.0) ** np.arange(18) / np.arange(1, 19)
_EXP = 1 / np.cumprod(np.arange(1.0, 21.0))
"""Coefficients of the series of log(1 + g) / g and (exp(w) - 1) / w."""


class _Path:
    """What a step's displacement v `reach` `chord` and its last velocity v `turned` are made of, and their derivatives."""

    def __init__(self, x: Array, dt: float) -> None:
        self.v, self.bend = x[..., 2] + 1j * x[..., 3], 2 * x[..., 4] + 1j * x[..., 5]
        self.speed = np.sqrt(x[..., 2] ** 2 + x[..., 3] ** 2 + _SLOW**2)
        self.braking = x[..., 4] * dt / self.speed < _STAND
        self.gained = np.maximum(x[..., 4] * dt / self.speed, _STAND)
        self.brake = np.where(self.braking, x[..., 4], 1.0)
        # A target that stops has moved for as long as the braking took.
        self.elapsed = np.where(self.braking, self.gained * self.speed / self.brake, dt)
        self.share, self.share_slope = _log_share(self.gained)
        self.reach = self.elapsed * self.share
        w = self.bend * (self.reach / self.speed)
        self.chord, self.chord_slope = _chord(w)
        self.turned = np.exp(w) / (1 + self.gained)


def _log_share(g: Array) -> tuple[Array, Array]:
    """Return log(1 + g) / g and its derivative (*b); near 0 by their series."""
    small = np.abs(g) < 0.1
    inside, safe = np.where(small, g, 0.0), np.where(small, 1.0, g)
    share = np.log1p(safe) / safe
    slope = (1 / (1 + safe) - share) / safe
    return np.where(small, polyval(inside, _LOG), share), np.where(small, polyval(inside, polyder(_LOG)), slope)


def _chord(w: Any) -> tuple[Array, Array]:
    """Return (exp(w) - 1) / w and its derivative (*b) of complex w; near 0 by their series."""
    small = np.abs(w) < 1
    inside, safe = np.where(small, w, 0.0), np.where(small, 1.0, w)
    chord = np.expm1(safe) / safe
    slope = (np.exp(safe) - chord) / safe
    return np.where(small, polyval(inside, _EXP), chord), np.where(small, polyval(inside, polyder(_EXP)), slope)


def _real(z: Any) -> Array:
    """Return complex numbers as two components: (*b) -> (*b, 2)."""
    return np.stack([z.real, z.imag], axis=-1)


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

    >>> model, T, v, forward, left = Curvilinear(0.3, 0.4), 3.0, 8.0 - 6.0j, 0.5, -1.2
    >>> x, times = np.array([100.0, 50.0, 8.0, -6.0, forward, left]), (np.arange(30000) + 0.5) * 1e-4
    >>> course = np.angle(v) + left / forward * np.log(1.0 + forward * times / 10.0)  # the integral of left / speed
    >>> path = 1e-4 * np.sum((10.0 + forward * times) * np.exp(1j * course))
    >>> after = 11.5 * np.exp(1j * (np.angle(v) + left / forward * np.log(1.15)))
    >>> np.allclose(model.move(x, T), [100.0 + path.real, 50.0 + path.imag, after.real, after.imag, forward, left])
    True
    >>> by_differences = [(model.move(x + d, T) - model.move(x - d, T)) / 2e-6 for d in 1e-6 * np.eye(6)]
    >>> np.allclose(model.jacobian(x, T), np.transpose(by_differences), atol=1e-6)
    True
    >>> f, n = np.array([0.8, -0.6]), np.array([0.6, 0.8])  # along the path, and to the left of it
    >>> Q, position = model.noise(x, T), T**5 / 20.0 * (0.09 * np.outer(f, f) + 0.16 * np.outer(n, n))
    >>> np.allclose(Q[:2, :2], position), np.allclose(Q[0, 4:], T**3 / 6.0 * np.array([0.8 * 0.09, 0.6 * 0.16]))
    (True, True)
    """

    kind: ClassVar[str] = "curvilinear"
    state: ClassVar[Space] = _STATE

    sigma_tangential: float = fields.quantity(
        "m/s^2.5", "deviation of the acceleration gained along the path in 1 s", above=0
    )
    sigma_normal: float = fields.quantity("m/s^2.5", "deviation of that gained to the left of it in 1 s", above=0)

    @property
    def twin(self) -> Twin | None:
        return compiled.twin(self.kind, self.sigma_tangential, self.sigma_normal)

    def move(self, x: Array, dt: float) -> Array:
        p = _Path(x, dt)
        moved = x.copy()
        moved[..., :2] += _real(p.v * p.reach * p.chord)
        moved[..., 2:4] = _real(p.v * p.turned)
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        p = _Path(x, dt)
        F = np.zeros((*x.shape, 6))
        F[..., range(6), range(6)] = 1.0
        # dv, ds, da_t and da_n of each column
        by_velocity: list[tuple[complex, Array | float, float, float]]
        by_velocity = [(1.0, p.v.real / p.speed, 0.0, 0.0), (1j, p.v.imag / p.speed, 0.0, 0.0)]
        for column, (dv, ds, da, dn) in enumerate([*by_velocity, (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)], 2):
            gain = np.where(p.braking, 0.0, (da * dt - p.gained * ds) / p.speed)
            longer = np.where(p.braking, (p.gained * ds - da * p.elapsed) / p.brake, 0.0)
            reach = longer * p.share + p.elapsed * p.share_slope * gain
            dw = (2 * da + 1j * dn) * p.reach / p.speed + p.bend * (reach - p.reach / p.speed * ds) / p.speed
            step = dv * p.reach * p.chord + p.v * (reach * p.chord + p.reach * p.chord_slope * dw)
            F[..., :2, column] += _real(step)
            after = dv * p.turned + p.v * p.turned * (dw - gain / (1 + p.gained))
            F[..., 2:4, column] = _real(after)
        return F

    def noise(self, x: Array, dt: float) -> Array:
        course = np.arctan2(x[..., 3], x[..., 2])
        frame = np.stack([np.cos(course), -np.sin(course), np.sin(course), np.cos(course)], axis=-1)
        turn = np.zeros((*course.shape, 6, 6))
        turn[..., :2, :2] = turn[..., 2:4, 2:4] = frame.reshape(*course.shape, 2, 2)
        turn[..., 4:, 4:] = np.eye(2)
        own = np.zeros((6, 6))
        own[::2, ::2], own[1::2, 1::2] = white_jerk(self.sigma_tangential, dt), white_jerk(self.sigma_normal, dt)
        Q = turn @ own @ np.swapaxes(turn, -1, -2)
        return kernels.symmetric(Q)
