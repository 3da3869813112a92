"""The prior of a track that starts at a single return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Array, Detections, Gaussian, Indices, Newborn, Sensor, Space
from vedette_standard.regions import PLANE, Polygon, held


def one_point(
    sensor: Sensor, detections: Detections, returns: Indices, spread: Mapping[str, float], state: Space
) -> Gaussian:
    """Return the prior (j, n) of tracks at returns (j,): what a return says by `invert`, else mean 0 and `spread`.

    ValueError if neither states an axis.
    """
    spot = sensor.invert(detections.z[returns], detections.noise_of(returns))
    count, n, seen = len(returns), len(state), state.locate(sensor.observes)
    deviations = [spread.get(name) for name in state.names]
    if lacking := [repr(name) for i, name in enumerate(state.names) if deviations[i] is None and i not in seen]:
        raise ValueError(f"spread: must state the standard deviation of {', '.join(lacking)} in new tracks")
    mean, cov = np.zeros((count, n)), np.zeros((count, n, n))
    for i, deviation in enumerate(deviations):
        cov[:, i, i] = (deviation or 0.0) ** 2
    for i, axis in enumerate(seen):
        mean[:, axis] = spot.mean[:, i]
        for j, other in enumerate(seen):
            cov[:, axis, other] = spot.cov[:, i, j]
    return Gaussian(mean, cov)


def within(areas: Sequence[Polygon], begin: Newborn, state: Space) -> Newborn:
    """Return the tracks (j,) that begin in one of some areas; all where there are none."""
    if not areas:
        return begin
    keep = held(areas, begin.prior.mean[:, state.locate(PLANE)])
    return Newborn(begin.returns[keep], Gaussian(begin.prior.mean[keep], begin.prior.cov[keep]), begin.existence[keep])


_NONE: Indices = np.zeros(0, dtype=np.intp)


def unclaimed(detections: Detections, claimed: Array, least: float) -> Indices:
    """Return the complete returns that no track claims with a probability (k,) of `least` or more."""
    free = claimed < least
    return np.flatnonzero(detections.complete & free) if np.count_nonzero(free) else _NONE
