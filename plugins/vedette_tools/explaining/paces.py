"""How returns move that follow one another as a target's do, against what is believed of a new track there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Scan, Sensor, Tracker
from vedette_tools.drafting.chains import LEAST, chains, spacing
from vedette_tools.explaining.situation import Seen
from vedette_tools.explaining.steady_state import begun_at

SCANS, WIDTH = 60, 4.0
"""So many scans are looked at, and returns follow one another within so many standard deviations of the sensor's."""

CHANCE = 0.1
"""Where so many returns of a scan lie within that, rows of them may be chance: by hand."""

BEYOND = 5.0
"""Standard deviations of a new track's velocity."""


@frozen(eq=False)
class Placed:
    """Scans with returns that lie at places: their sensor as it stood, the spots (k, 2) of each, and a spot's deviation."""

    scans: Sequence[Scan]
    sensors: Sequence[Sensor]
    spots: Sequence[Array]
    error: float


def strange_paces(tracker: Tracker, seen: Seen) -> tuple[int, Array]:
    """Return how many rows of returns move steadily, and the velocities (c, 2) of those whose track would hardly believe it.

    A row counts if a track begins at its first return at once: births of two scans see how it moves.
    """
    names, count, strange = tracker.state.names, 0, []
    able = {"x", "y", "vx", "vy"} <= {*names} and seen.name in tracker.starters
    placed = _placed(seen) if able else None
    if placed is None:
        return 0, np.zeros((0, 2))
    pace, width = [names.index(name) for name in ("vx", "vy")], WIDTH * placed.error
    times = np.array([scan.time for scan in placed.scans])
    for chain in chains(times, placed.spots, width, spacing(placed.spots)):
        first, last = chain.scans[0], min(LEAST, len(chain.times)) - 1
        returns = placed.scans[first].detections
        z = returns.z[returns.valid][chain.returns[0]]
        prior = begun_at(tracker, placed.sensors[first], seen.name, z, seen.dt or 0.0, scans=1)
        if prior is not None:
            count += 1
            took = chain.times[last] - chain.times[0]
            velocity = (chain.spots[last] - chain.spots[0]) / took
            apart = np.abs(velocity - prior.mean[0, pace])
            spread = np.hypot(_deviations(prior, pace), 2.0 * placed.error / took)
            strange += [velocity] if np.any(apart > BEYOND * spread) else []
    return count, np.array(strange).reshape(-1, 2)


def _placed(seen: Seen) -> Placed | None:
    """Return the first scans whose returns give a place; None for few such, or where rows of returns may be chance."""
    scans = [scan for scan in seen.came.scans[:SCANS] if scan.detections.missing is None]
    if len(scans) < LEAST:
        return None
    try:
        sensors = [seen.sensor.placed(scan.pose) for scan in scans]
        priors = [_inverted(sensor, scan) for sensor, scan in zip(sensors, scans, strict=True)]
        where = [sensors[0].observes.names.index(axis) for axis in "xy"]
    except (NotImplementedError, ValueError):
        return None
    spots = [prior.mean[:, where] for prior in priors]
    variance = np.concatenate([prior.cov[:, where, where] for prior in priors])
    if not len(variance):
        return None
    error, area = float(np.sqrt(np.median(variance))), float(np.prod(np.ptp(np.concatenate(spots), axis=0)))
    few = len(variance) / len(scans) * np.pi * (WIDTH * error) ** 2 < CHANCE * area
    return Placed(scans, sensors, spots, error) if few else None


def _inverted(sensor: Sensor, scan: Scan) -> Gaussian:
    seen = scan.detections
    return sensor.invert(seen.z[seen.valid], seen.noise_of(seen.valid))


def _deviations(prior: Gaussian, axes: list[int]) -> Array:
    return np.sqrt(np.diagonal(prior.cov, axis1=-2, axis2=-1)[0, axes])
