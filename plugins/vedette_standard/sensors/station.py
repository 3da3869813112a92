"""Helpers of sensors at a position: offsets from their pose, and a copy of them elsewhere."""

from __future__ import annotations

import math
from copy import copy
from typing import Protocol, TypeVar, runtime_checkable

import numpy as np

from vedette import Array, Pose, Sensor, Space, WrappedSensor

POSITION = Space.of(x="m", y="m")

S = TypeVar("S", bound=Sensor)


@runtime_checkable
class Stationed(Protocol):
    """A sensor that says where it stands, and from there sees directions."""

    @property
    def pose(self) -> Pose:
        """Where it stands: its own place, or where `at` placed it."""


def stands(sensor: Sensor) -> Pose | None:
    """Return where a sensor, or that which it wraps, stands; None: it does not say."""
    while isinstance(sensor, WrappedSensor):
        sensor = sensor.of
    return sensor.pose if isinstance(sensor, Stationed) else None


def placed(sensor: S, pose: Pose) -> S:
    """Return a copy of a sensor whose field `_pose` is `pose`. No parameter changes, so none is read and checked again."""
    copied = copy(sensor)
    object.__setattr__(copied, "_pose", pose)
    return copied


def leading(values: Array | float, axes: int) -> Array:
    """Return a pose's values (*b) as (*b, 1, ..) with `axes` axes: its batch axes lead those of the states that it meets."""
    values = np.asarray(values)
    return values.reshape(values.shape + (1,) * (axes - values.ndim)) if values.ndim else values


def offsets(x: Array, pose: Pose) -> tuple[Array, Array]:
    """Return positions (*b, .., 2) as seen from `pose` (*b): their x and y less its own, each (*b, ..), in m."""
    axes = x.ndim - 1
    return x[..., 0] - leading(pose.position[..., 0], axes), x[..., 1] - leading(pose.position[..., 1], axes)


def covers(probability: float, min_range: float, max_range: float | None, x: Array, pose: Pose) -> Array:
    """Return the detection probability (*b, ..) at x (*b, .., 2): `probability` within range, else 0; () without limits."""
    if max_range is None and min_range == 0:
        return np.asarray(probability)
    r = np.hypot(*offsets(x, pose))
    return np.where((r >= min_range) & (r <= (math.inf if max_range is None else max_range)), probability, 0.0)
