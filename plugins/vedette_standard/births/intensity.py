"""Unseen targets as a sum of Gaussians, each thinned in cells of the plane."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import frozen

from vedette import Array, Estimator, Indices, Mixtures
from vedette.tracking import take
from vedette_standard.births import in_gaussians

ALIKE = 0.01
"""Growth of the volume, as a logarithm, up to which two Gaussians are one: an error of so much in what it holds."""


@final
@frozen(eq=False)
class Intensity:
    """Unseen targets of c Gaussians, which are the beliefs of the tracker's filter, in cells (c, n, .., n) of the plane.

    place (c,): which place of the config they appeared in, -1 where they are of a track that ended.
    """

    number: Array
    belief: Any
    place: Indices

    @property
    def weights(self) -> Array:
        """Their expected number (c,) in each Gaussian."""
        return np.asarray(np.mean(self.number, axis=tuple(range(1, self.number.ndim))))


def fewer(intensity: Intensity, estimator: Estimator[Any], dt: float) -> Intensity:
    """Return what looks have cut, mixed by dt of motion; of two Gaussians that are alike, one.

    What no look thins lives long, and else there would be a Gaussian for each scan of its life.
    """
    it = take(intensity, np.argsort(intensity.place, kind="stable"), 0)
    prior = estimator.moments(it.belief)
    number = in_gaussians.mixed_by_motion(it.number, prior, estimator.state, dt)
    alike = in_gaussians.pairs_alike(prior, estimator.state, ALIKE) & (np.diff(it.place) == 0) & (it.place[1:] >= 0)
    first = np.flatnonzero(np.append(True, ~alike))
    into = np.cumsum(np.append(True, ~alike)) - 1
    shares = it.weights / np.bincount(into, it.weights)[into]
    try:
        belief = estimator.merge(it.belief, Mixtures(into, np.arange(len(into)), shares, len(first)))
    except NotImplementedError:
        return Intensity(number, it.belief, it.place)
    return Intensity(np.add.reduceat(number, first), belief, it.place[first])
