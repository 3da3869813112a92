"""Range and bearing of positions in the plane, and their derivative."""

from __future__ import annotations

import numpy as np

from vedette import Array, Pose
from vedette_standard.sensors.station import leading, offsets

NEAR = 1e-3
"""Distance in m below which derivatives no longer grow."""


def ranges_and_bearings(x: Array, pose: Pose) -> Array:
    """Return distance, and direction less the heading, not wrapped; over the sensor that of +x: (*b, 2) -> (*b, 2)."""
    dx, dy = offsets(x, pose)
    z = np.empty((*dx.shape, 2))
    z[..., 0] = np.hypot(dx, dy)
    z[..., 1] = np.arctan2(dy, dx) - leading(pose.heading, dx.ndim)
    return z


def polar_slope(x: Array, pose: Pose) -> Array:
    """Return the derivative (*b, 2) -> (*b, 2, 2); within 1 mm that of a target 1 mm away, times the distance in mm."""
    dx, dy = offsets(x, pose)
    r = np.maximum(np.hypot(dx, dy), NEAR)
    H = np.empty((*dx.shape, 2, 2))
    H[..., 0, 0] = dx / r
    H[..., 0, 1] = dy / r
    H[..., 1, 0] = -H[..., 0, 1] / r
    H[..., 1, 1] = H[..., 0, 0] / r
    return H
