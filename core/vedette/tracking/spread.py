"""How uncertain the position of a track is."""

from __future__ import annotations

import numpy as np

from vedette.space import Array, Space
from vedette.types import Gaussian


def largest_deviation(estimate: Gaussian, state: Space) -> Array:
    """Return the largest standard deviation of each position, over the axes of `state` in m: (*b, t)."""
    position = [i for i, axis in enumerate(state.axes) if axis.unit == "m"]
    deviation: Array = np.sqrt(np.linalg.eigvalsh(estimate.cov[..., position, :][..., position])[..., -1])
    return deviation
