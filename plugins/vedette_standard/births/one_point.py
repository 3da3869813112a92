"""The prior of a track that starts at a single return."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vedette import Array, Detections, Gaussian, Indices, Mask, Newborn, Sensor, Space
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
    count, n, seen = len(returns), len(state), state.locate(sensor.observes)
    mean, cov = np.zeros((count, n)), np.zeros((count, n, n))
    cov[:, range(n), range(n)] = [spread.get(axis, 0.0) ** 2 for axis in state.names]
    mean[:, seen] = spot.mean
    cov[:, np.array(seen)[:, None], seen] = spot.cov
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
    return complete(detections, free) if np.count_nonzero(free) else _NONE


def complete(detections: Detections, among: Mask | bool = True) -> Indices:
    """Return the returns that are valid and lack no component, of those `among` (k,)."""
    whole = detections.valid & among
    return np.flatnonzero(whole if detections.missing is None else whole & ~detections.missing.any(axis=-1))
