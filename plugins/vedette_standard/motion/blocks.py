"""What the linear planar models share."""

from __future__ import annotations

import numpy as np

from vedette import Array


def planar(block: Array) -> Array:
    """A matrix (p, p) over one axis' derivatives -> (2p, 2p) over x, y, vx, vy ...: the same for both axes, uncoupled."""
    p = len(block)
    both = np.zeros((p, 2, p, 2))
    both[:, 0, :, 0] = both[:, 1, :, 1] = block
    return both.reshape(2 * p, 2 * p)
