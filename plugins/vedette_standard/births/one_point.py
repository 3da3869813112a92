"""The prior of a track that starts at a single return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Detections, Gaussian, Indices, Newborn, Sensor, Space
from vedette_standard.regions import PLANE, Polygon, held


def one_point(
    sensor: Sensor, detections: Detections, returns: Indices, spread: Mapping[str, float], state: Space
) -> Gaussian:
    """Return the prior (j, n) of tracks at returns (j,): what a return says by `invert`, else mean 0 and `spread`.

    ValueError if neither states an axis.
    """
    noise = None if detections.noise is None else detections.noise[returns]
    spot = sensor.invert(detections.z[returns], noise)
    lacking = [axis for axis in state.names if axis not in sensor.observes and axis not in spread]
    if lacking:
        raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
    count, n, own = len(returns), len(state), state.locate(sensor.observes)
    mean, cov = np.zeros((count, n)), np.zeros((count, n, n))
    cov[:, range(n), range(n)] = [spread.get(axis, 0.0) ** 2 for axis in state.names]
    mean[:, own] = spot.mean
    cov[:, np.array(own)[:, None], own] = spot.cov
    return Gaussian(mean, cov)


def within(areas: Sequence[Polygon], begin: Newborn, state: Space) -> Newborn:
    """Return the tracks (j,) that begin in one of some areas; all where there are none."""
    if not areas:
        return begin
    keep = held(areas, begin.prior.mean[:, state.locate(PLANE)])
    return Newborn(begin.returns[keep], Gaussian(begin.prior.mean[keep], begin.prior.cov[keep]), begin.existence[keep])


def complete(detections: Detections) -> Indices:
    """Return the returns that are valid and lack no component."""
    whole = detections.valid if detections.missing is None else detections.valid & ~detections.missing.any(axis=-1)
    return np.flatnonzero(whole)
