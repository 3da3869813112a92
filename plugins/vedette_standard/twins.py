"""The compiled twins of this plugin's sensors and motions, where they were built."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette import Array, Pose
from vedette.kernels import Twin

FUNCTIONS: dict[str, dict[str, Any]]
"""By instruction set, best last, the functions of each kind that has one."""

try:
    from vedette_standard import _twins
except ModuleNotFoundError:
    FUNCTIONS = {}
else:
    FUNCTIONS = _twins.functions()


def of(kind: str, *parameters: float) -> Twin | None:
    """Return the twin of a kind with these parameters, or None where none was built."""
    return _of(kind, np.array(parameters, dtype=float))


def placed(kind: str, pose: Pose, *parameters: float | Array | None) -> Twin | None:
    """Return the twin of a sensor: its parameters follow x, y and heading of the pose, of which any may lead with runs."""
    place = pose.position
    numbers = (place[..., 0], place[..., 1], pose.heading, *parameters)
    whole = np.array(numbers, dtype=float) if place.ndim == 1 and np.ndim(pose.heading) == 0 else _stacked(numbers)
    return _of(kind, whole)


def _stacked(numbers: tuple[Any, ...]) -> Array:
    return np.stack(np.broadcast_arrays(*numbers), axis=-1)


def _of(kind: str, parameters: Array) -> Twin | None:
    for functions in reversed(FUNCTIONS.values()):
        return Twin(functions[kind], parameters)
    return None
