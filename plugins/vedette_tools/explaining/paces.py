"""How returns move that follow one another as a target's do, against what is believed of a new track there."""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array
from vedette.tracking import Tracker
from vedette.types import Gaussian, Scan
from vedette_tools.drafting.chains import LEAST, chains, spacing
from vedette_tools.explaining.situation import Seen
from vedette_tools.explaining.steady_state import begun_at

SCANS, WIDTH = 60, 4.0
"""So many scans are looked at, and returns follow one another within so many standard deviations of the sensor's."""

CHANCE = 0.1
"""Where so many returns of a scan lie within that, rows of them may be chance: by hand."""

BEYOND = 5.0
"""Standard deviations of a new track's velocity."""


def strange_paces(tracker: Tracker, seen: Seen) -> tuple[int, Array]:
    """Return how many rows of returns move steadily, and the velocities (c, 2) of those whose track would hardly believe it.

    A row counts if a track begins at its first return at once: births of two scans see how it moves.
    """
    names = tracker.state.names
    scans = [scan for scan in seen.came.scans[:SCANS] if scan.detections.missing is None]
    if not {"x", "y", "vx", "vy"} <= {*names} or seen.name not in tracker.starters or len(scans) < LEAST:
        return 0, np.zeros((0, 2))
    pace = [names.index(name) for name in ("vx", "vy")]
    try:
        placed = [seen.sensor if scan.pose is None else seen.sensor.at(scan.pose) for scan in scans]
        priors = [_inverted(sensor, scan) for sensor, scan in zip(placed, scans, strict=True)]
        where = [sensor.observes.names.index(axis) for sensor in placed[:1] for axis in "xy"]
    except (NotImplementedError, ValueError):
        return 0, np.zeros((0, 2))
    spots = [prior.mean[:, where] for prior in priors]
    every = np.concatenate([prior.cov[:, where, where] for prior in priors])
    error = float(np.sqrt(np.median(every))) if len(every) else np.inf
    area = float(np.prod(np.ptp(np.concatenate(spots), axis=0))) if len(every) else 0.0
    if not len(every) / len(scans) * np.pi * (WIDTH * error) ** 2 < CHANCE * area:
        return 0, np.zeros((0, 2))
    count, strange = 0, []
    for chain in chains(np.array([scan.time for scan in scans]), spots, WIDTH * error, spacing(spots)):
        first, last = chain.scans[0], min(LEAST, len(chain.times)) - 1
        z = scans[first].detections.z[scans[first].detections.valid][chain.returns[0]]
        prior = begun_at(tracker, placed[first], seen.name, z, seen.dt or 0.0, scans=1)
        if prior is not None:
            count += 1
            velocity = (chain.spots[last] - chain.spots[0]) / (chain.times[last] - chain.times[0])
            apart = np.abs(velocity - prior.mean[0, pace])
            spread = np.hypot(_deviations(prior, pace), 2.0 * error / (chain.times[last] - chain.times[0]))
            strange += [velocity] if np.any(apart > BEYOND * spread) else []
    return count, np.array(strange).reshape(-1, 2)


def _inverted(sensor: Sensor, scan: Scan) -> Gaussian:
    seen = scan.detections
    return sensor.invert(seen.z[seen.valid], None if seen.noise is None else seen.noise[seen.valid])


def _deviations(prior: Gaussian, axes: list[int]) -> Array:
    deviations: Array = np.sqrt(np.diagonal(prior.cov, axis1=-2, axis2=-1)[0, axes])
    return deviations
