"""Which boxes of a track are worth showing: those that were seen, and those whose place is well known meanwhile."""

from __future__ import annotations

import numpy as np

from vedette import NO_AXES, Array, Gaussian, Mask, Space
from vedette.filters import marginal
from vedette_boxes.sensors.box import BOX

SEEN = 0.5
"""Probability that a box of the frame was the track's from which on it is shown."""

SURE = (1.0 - np.sqrt(2.0 / 3.0)) / 3.0
"""Standard deviation s of the middle, in sides, up to which a box is shown without: three of them off, along both sides, it
still overlaps the true one by half, (1 - 3 s)^2 / (2 - (1 - 3 s)^2) = 1/2.
"""


def shown(states: Gaussian, space: Space, hit: Array) -> tuple[Array, Mask]:
    """Return boxes (*b, 4) of states over a space, and which of them to show; hit: the probability (*b) of being seen."""
    box = marginal(states, space, BOX, NO_AXES)
    sides, deviations = box.mean[..., 2:], np.sqrt(np.diagonal(box.cov, axis1=-2, axis2=-1)[..., :2])
    known: Mask = np.all(sides > 0, axis=-1) & ((hit >= SEEN) | np.all(deviations <= SURE * sides, axis=-1))
    return box.mean, known
