"""What the planar models share."""

from __future__ import annotations

import numpy as np

from vedette import Array, Space

POSITION_VELOCITY = Space.of(x="m", y="m", vx="m/s", vy="m/s")
POSITION_VELOCITY_ACCELERATION = Space.of(x="m", y="m", vx="m/s", vy="m/s", ax="m/s^2", ay="m/s^2")


def planar(block: Array) -> Array:
    """A matrix (p, p) over one axis' derivatives -> (2p, 2p) over x, y, vx, vy ...: the same for both axes, uncoupled."""
    p = len(block)
    both = np.zeros((p, 2, p, 2))
    both[:, 0, :, 0] = both[:, 1, :, 1] = block
    return both.reshape(2 * p, 2 * p)


def white_acceleration(sigma: float, dt: float) -> Array:
    """Covariance (4, 4) over x, y, vx, vy of white-noise acceleration after `dt`; `sigma`: of the velocity gained in 1 s."""
    q = sigma**2
    return planar(np.array([[q * dt**3 / 3, q * dt**2 / 2], [q * dt**2 / 2, q * dt]]))
