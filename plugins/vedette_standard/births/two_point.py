"""Tracks that start at the returns of two scans."""

from __future__ import annotations

from functools import cache
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Indices, Newborn, Sensor, Space, fields
from vedette.errors import ScanRefused
from vedette_standard.births.one_point import unclaimed, within
from vedette_standard.regions import Polygon


@frozen(eq=False)
class Waiting:
    """Positions (k, d) and covariances (k, d, d) of returns that no track claimed, in the scan `ago` () s before."""

    mean: Array
    cov: Array
    ago: Array


@final
@frozen
class TwoPoint(Birth):
    """Starts a track at a return that a target of up to `max_speed` can have reached from one of the scan before.

    z2 and z1, dt apart, give the position z2 and the velocity (z2 - z1) / dt, with the covariances R2, (R1 + R2) / dt^2 and
    R2 / dt between them: two-point differencing. Both returns belong to no track; of several earlier ones the nearest
    counts. Other axes are 0 with the standard deviations in `spread`.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.5.3.
    """

    kind: ClassVar[str] = "two_point"
    models_unseen: ClassVar[bool] = True

    max_speed: float = fields.quantity("m/s", "fastest that a target moves", above=0)
    spread: dict[str, float] = fields.table("state axis, neither position nor velocity, to its standard deviation")
    sensors: tuple[str, ...] = fields.words("sensors whose returns may start tracks; default: all", default=())
    claimed: float = fields.probability(
        "a return is left alone if it comes from a track with at least this probability", default=0.5, above=0
    )
    initial: float = fields.probability("probability that a new track is of a target", default=0.5, above=0)
    deviations: float = fields.quantity(
        "1", "noise that is added to what the speed allows, in standard deviations", default=3.0, at_least=0
    )
    appears_in: tuple[Polygon, ...] = fields.part(
        "areas outside of which no track starts; default: everywhere", default=(), tried=((),)
    )

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Waiting | None:
        """Return nothing: there was no scan yet."""
        return None

    def starts_from(self, sensor: str) -> bool:
        """Return whether it is one of `sensors`."""
        return not self.sensors or sensor in self.sensors

    def predict(
        self, memory: Waiting | None, estimator: Estimator[Any], dt: float, rng: np.random.Generator
    ) -> Waiting | None:
        """Return the returns of the scan before, `dt` longer ago."""
        return None if memory is None else Waiting(memory.mean, memory.cov, memory.ago + dt)

    def update(
        self,
        memory: Waiting | None,
        estimator: Estimator[Any],
        sensor: Sensor,
        detections: Detections,
        claimed: Array,
        p_gate: float,
    ) -> Waiting:
        """Return this scan's returns that no track claims; ScanRefused if they have times of their own."""
        if detections.time is not None:
            told = "'two_point' takes all returns of a scan to be of one time: use 'from_returns', or leave their times out"
            raise ScanRefused(f"birth: {told}")
        rows = unclaimed(detections, claimed, self.claimed)
        if not len(rows):
            return _nothing(len(sensor.observes))
        spot = _spots(sensor, detections, rows)
        return Waiting(spot.mean, spot.cov, np.asarray(0.0))

    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each return that follows one of the scan before."""
        rows, state, position = unclaimed(detections, claimed, self.claimed), estimator.state, sensor.observes
        idle = found is None or found.ago == 0 or not len(found.mean) or not len(rows)
        if idle and len(claimed):
            return Newborn.none(len(state))
        velocity, spot = self._velocity(state, position), _spots(sensor, detections, rows)
        if idle:
            return Newborn.none(len(state))
        apart = np.linalg.norm(spot.mean[:, None] - found.mean[None], axis=-1)
        before = np.argmin(apart, axis=-1)
        total = spot.cov + found.cov[before]
        noise = np.sqrt(np.linalg.eigvalsh(total)[..., -1])
        near = np.min(apart, axis=-1) <= self.max_speed * found.ago + self.deviations * noise
        rows, before, spot = rows[near], before[near], Gaussian(spot.mean[near], spot.cov[near])
        count, n, seen = len(rows), len(state), np.array(state.locate(position))
        mean, cov = np.zeros((count, n)), np.zeros((count, n, n))
        cov[:, range(n), range(n)] = [self.spread.get(axis, 0.0) ** 2 for axis in state.names]
        mean[:, seen], mean[:, velocity] = spot.mean, (spot.mean - found.mean[before]) / found.ago
        cov[:, seen[:, None], seen] = spot.cov
        cov[:, seen[:, None], velocity] = cov[:, velocity[:, None], seen] = spot.cov / found.ago
        cov[:, velocity[:, None], velocity] = (spot.cov + found.cov[before]) / found.ago**2
        return within(self.appears_in, Newborn(rows, Gaussian(mean, cov), np.full(count, self.initial)), state)

    def _velocity(self, state: Space, position: Space) -> Indices:
        """Return the axes of the velocity, one for each of the position."""
        names = [f"v{name}" for name in position.names]
        if lacking := [name for name in names if name not in state]:
            raise ValueError(f"sensors: must observe positions with a velocity in the state, which lacks {lacking[0]!r}")
        known = {*names, *position.names, *self.spread}
        if lacking := [name for name in state.names if name not in known]:
            raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
        return np.array([state.names.index(name) for name in names])


@cache
def _nothing(axes: int) -> Waiting:
    """Return no return of a scan just now."""
    return Waiting(np.zeros((0, axes)), np.zeros((0, axes, axes)), np.asarray(0.0))


def _spots(sensor: Sensor, detections: Detections, rows: Indices) -> Gaussian:
    """Return the positions that some returns give."""
    return sensor.invert(detections.z[rows], None if detections.noise is None else detections.noise[rows])
