"""Which boxes of a track are worth showing: those that were seen, and those whose place is well known meanwhile."""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask

SEEN = 0.5
"""Probability that a box of the frame was the track's from which on it is shown."""

SURE = (1.0 - np.sqrt(2.0 / 3.0)) / 3.0
"""Standard deviation s of the middle, in sides, up to which a box is shown without: three of them off, along both sides, it
still overlaps the true one by half, (1 - 3 s)^2 / (2 - (1 - 3 s)^2) = 1/2.
"""


def shown(mean: Array, cov: Array, hit: Array) -> Mask:
    """Return which boxes to show: x, y, width, height (*b, 4), covariance (*b, 4, 4), probability of being seen (*b)."""
    sides, deviations = mean[..., 2:], np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1)[..., :2])
    known: Mask = np.all(sides > 0, axis=-1) & ((hit >= SEEN) | np.all(deviations <= SURE * sides, axis=-1))
    return known
