"""The common part of the target-oriented models: gains along and across a direction, and turns of a complex velocity."""

from __future__ import annotations

import numpy as np

from vedette import Array


def held_gain(direction: Array, sigma_forward: float, sigma_side: float, dt: float) -> tuple[Array, Array, Array]:
    """Return the covariance of position, position with velocity, and velocity, (*b, 2, 2) each, of a held acceleration.

    `direction` (*b, 2, 2) is f f', f the unit vector along which sigma_forward acts; sigma_side acts across.
    """
    accel = sigma_side**2 * np.eye(2) + (sigma_forward**2 - sigma_side**2) * direction
    return accel * (dt**4 / 4), accel * (dt**3 / 2), accel * dt**2


def chord(angle: Array) -> tuple[Array, Array]:
    """Return (exp(i a) - 1)/(i a), the mean of exp(i s) over s in [0, a], and its derivative by a, complex (*b) each.

    With h = a/2 it is exp(i h) sin(h)/h, which has no cancellation; the derivative of sin(h)/h needs its series near 0.
    """
    h = 0.5 * np.asarray(angle)
    turn, sinc = np.exp(1j * h), np.sinc(h / np.pi)
    square = h * h
    small = np.abs(h) < 0.25
    series = -h / 3 * (1 - square / 10 * (1 - square / 28 * (1 - square / 54 * (1 - square / 88))))
    slope = np.where(small, series, (np.cos(h) - sinc) / np.where(small, 1.0, h))
    return turn * sinc, 0.5 * turn * (slope + 1j * sinc)
