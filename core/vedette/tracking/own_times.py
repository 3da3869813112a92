"""Returns with times of their own, as a rotating antenna gives: each meets the tracks as they are expected at its time.

A track is predicted to a return's time, takes it there, and is predicted on to the scan's. So mean, S and posterior are
those of a filter that steps through the returns one by one, and noise between return and scan counts as it is.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette.filters.motion import predicted
from vedette.roles import Estimator, Sensor
from vedette.space import Array, Indices
from vedette.tracking import pytrees
from vedette.types import Detections, Innovation, Mixtures, Scan


@frozen(eq=False)
class AtOwnTimes:
    """The detail of an innovation: `places` (t, k) in `beliefs` of what each track is at the scan if it took each return."""

    places: Indices
    beliefs: pytrees.Common


def moments_of(scan: Scan, observed: Detections, dt: float) -> list[tuple[float, float, Indices]]:
    """Return the times at which returns were measured, each in s after the last scan and before this one, and which were.

    dt: s between the scans. A return from before the last scan, of another sensor, is taken at the time of that.
    """
    assert observed.time is not None
    ago, which = np.unique(np.minimum(scan.time - observed.time, dt), return_inverse=True)
    return [(dt - rest, rest, np.flatnonzero(which == i)) for i, rest in enumerate(ago.tolist())]


def evaluated(
    estimator: Estimator[Any], sensor: Sensor, beliefs: tuple[Any, Any], scan: Scan, observed: Detections, dt: float,
    p_gate: float, limit: Array | float, rng: np.random.Generator,
) -> Innovation:  # fmt: skip
    """Return the innovation of tracks whose `beliefs` are those after the last scan and at this one, dt s later.

    Of a return within `limit`, the gate's squared distance, its detail, `AtOwnTimes`, has what it makes of a track.
    """
    before, now = beliefs
    nothing = Detections.of([], observed.z.shape[-1])
    missed = estimator.evaluate(now, sensor, nothing, p_gate)
    shape = (len(missed.loglik), len(observed.z))
    loglik, volume = np.full((shape[0], 1 + shape[1]), -np.inf), missed.log_volume
    loglik[:, 0], distance, nis, places = missed.loglik[:, 0], np.full(shape, np.inf), np.zeros(shape), np.full(shape, -1)
    beliefs_after, count = [pytrees.take(now, slice(0), 0)], 0
    for ahead, rest, some in moments_of(scan, observed, dt):
        belief = predicted(estimator, before, ahead, rng)
        met = estimator.evaluate(belief, sensor, pytrees.take(observed, some, 0), p_gate)
        loglik[:, 1 + some], distance[:, some], nis[:, some] = met.loglik[:, 1:], met.distance, met.nis
        volume = np.maximum(volume, met.log_volume)
        tracks, column = np.nonzero(met.distance <= limit)
        sure = np.zeros((len(tracks), 1 + len(some)))
        sure[range(len(tracks)), 1 + column] = 1.0
        after = estimator.update(pytrees.take(belief, tracks, 0), pytrees.take(met, tracks, 0), sure)
        places[tracks, some[column]], count = count + np.arange(len(tracks)), count + len(tracks)
        beliefs_after.append(predicted(estimator, after, rest, rng))
    return Innovation(loglik, distance, volume, nis, AtOwnTimes(places, pytrees.Common(pytrees.in_order(beliefs_after))))


def updated(estimator: Estimator[Any], belief: Any, innovation: Innovation, weights: Array) -> Any:
    """Return the posterior under association weights (t, 1+k), whatever the times of the returns."""
    taken = innovation.detail
    if not isinstance(taken, AtOwnTimes):
        return estimator.update(belief, innovation, weights)
    rows, column = np.nonzero(weights)
    parts = np.where(column > 0, len(weights) + taken.places[rows, column - 1], rows) if column.any() else rows
    mixtures = Mixtures(rows, parts, weights[rows, column], len(weights))
    return estimator.merge(pytrees.in_order([belief, taken.beliefs.value]), mixtures)


def at_the_scan(estimator: Estimator[Any], belief: Any, ago: Array, rng: np.random.Generator) -> Any:
    """Return the belief of tracks that began so many s (t,) before the scan."""
    if not len(ago):
        return belief
    times, which = np.unique(ago, return_inverse=True)
    rows = [np.flatnonzero(which == i) for i in range(len(times))]
    begun = [pytrees.take(belief, rows_of, 0) for rows_of in rows]
    return pytrees.in_order([predicted(estimator, one, dt, rng) for one, dt in zip(begun, times, strict=True)], rows)
