"""Where a track is, and how uncertain that is."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Space
from vedette.supporting import Lifecycle
from vedette.types import Gaussian

PLANE = Space.of(x="m", y="m")


def check_spread(lifecycle: Lifecycle, state: Space) -> None:
    """Raise ValueError, with its place, if a lifecycle asks for positions that the state does not have."""
    if lifecycle.needs_place and not {*PLANE.axes} <= {*state.axes}:
        raise ValueError("lifecycle: must not ask where a track is, as the state has no x and y in m")
    if lifecycle.needs_spread and not any(axis.unit == "m" for axis in state.axes):
        units = ", ".join(f"{axis.name} [{axis.unit}]" for axis in state.axes)
        raise ValueError(f"lifecycle: must not limit the position's spread, in m, as no axis of the state is in m: {units}")


def largest_deviation(estimate: Gaussian, state: Space) -> Array:
    """Return the largest standard deviation of each position, over the axes of `state` in m: (*b, t)."""
    position = [i for i, axis in enumerate(state.axes) if axis.unit == "m"]
    deviation: Array = np.sqrt(np.linalg.eigvalsh(estimate.cov[..., position, :][..., position])[..., -1])
    return deviation
