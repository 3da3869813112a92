"""Tracks that start at the returns of two scans."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Newborn, Sensor, fields
from vedette.errors import ScanRefused
from vedette_standard.births.following import Waiting, fastest, in_state, nothing, pairs, spots, velocity_axes
from vedette_standard.births.one_point import unclaimed, within
from vedette_standard.regions import Polygon


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
    sensor_speeds: dict[str, float] = fields.table(
        "sensor to the fastest of what it sees, in m/s, in the place of `max_speed`", at_least=0, tried=({},)
    )
    class_speeds: Array = fields.array(
        "m/s", "the fastest of each class, where returns name theirs by codes 0, 1, ..: no more than this", ndim=1,
        default=np.zeros(0),
    )  # fmt: skip
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
        return None if memory is None else memory.later(dt)

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
            return nothing(len(sensor.observes))
        spot = spots(sensor, detections, rows)
        return Waiting(spot.mean, spot.cov, np.asarray(0.0))

    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each return that follows one of the scan before."""
        rows, state, position = unclaimed(detections, claimed, self.claimed), estimator.state, sensor.observes
        idle = found is None or found.idle or not len(rows)
        if idle and len(claimed):
            return Newborn.none(len(state))
        velocity_axes(position, self.spread, state)
        spot = spots(sensor, detections, rows)
        if idle:
            return Newborn.none(len(state))
        limit = fastest(self.max_speed, self.sensor_speeds, self.class_speeds, name, detections)[rows]
        near, moving = pairs(spot, found, limit, self.deviations)
        prior = in_state(moving, position, self.spread, state)
        return within(self.appears_in, Newborn(rows[near], prior, np.full(len(near), self.initial)), state)
