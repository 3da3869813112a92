"""What sensors share that stand somewhere: offsets from their pose, and a copy of them elsewhere."""

from __future__ import annotations

import math
from copy import copy
from typing import TypeVar

import numpy as np

from vedette import Array, Pose, Sensor, Space

POSITION = Space.of(x="m", y="m")

S = TypeVar("S", bound=Sensor)


def standing(sensor: S, pose: Pose) -> S:
    """A copy of a sensor whose field `_pose` is `pose`. No parameter changes, so none is read and checked again."""
    placed = copy(sensor)
    object.__setattr__(placed, "_pose", pose)
    return placed


def leading(values: Array | float, axes: int) -> Array:
    """A pose's values (*b) as (*b, 1, ..) with `axes` axes: its batch axes lead those of the states that it meets."""
    values = np.asarray(values)
    return values.reshape(values.shape + (1,) * (axes - values.ndim)) if values.ndim else values


def offsets(x: Array, pose: Pose) -> tuple[Array, Array]:
    """Positions (*b, .., 2) as seen from `pose` (*b): their x and y less its own, each (*b, ..), in m."""
    axes = x.ndim - 1
    return x[..., 0] - leading(pose.position[..., 0], axes), x[..., 1] - leading(pose.position[..., 1], axes)


def covers(probability: float, min_range: float, max_range: float | None, x: Array, pose: Pose) -> Array:
    """Detection probability (*b, ..) at positions (*b, .., 2): `probability` within range, else 0; () without limits."""
    if max_range is None and min_range == 0:
        return np.asarray(probability)
    r = np.hypot(*offsets(x, pose))
    return np.where((r >= min_range) & (r <= (math.inf if max_range is None else max_range)), probability, 0.0)
