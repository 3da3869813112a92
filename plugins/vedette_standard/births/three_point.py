"""Tracks that start at the returns of three scans."""

from __future__ import annotations

from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Newborn, Sensor, fields
from vedette.errors import ScanRefused
from vedette_standard.births.following import Waiting, fastest, in_state, pairs, spots, velocity_axes
from vedette_standard.births.one_point import unclaimed, within
from vedette_standard.regions import Polygon


@frozen(eq=False)
class Chains:
    """The returns of the scan before, and positions and velocities (j, 2d), (j, 2d, 2d) of those that follow another."""

    last: Waiting
    mean: Array
    cov: Array


@final
@frozen
class ThreePoint(Birth):
    """Starts a track at a return that goes on as two of the scans before do: at speeds up to `max_speed`, nearly straight.

    The first two give position and velocity by two-point differencing. That is moved to the third, with the covariance
    (a dt^2 / 2)^2 of what an acceleration a = `max_acceleration` does to the position, and (a dt)^2 to the velocity; the
    return lies within `deviations` of it and updates it. No three belong to tracks; the nearest counts. False returns start
    fewer tracks than by two scans, and real ones start a scan later.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.3.
    """

    kind: ClassVar[str] = "three_point"
    models_unseen: ClassVar[bool] = True

    max_speed: float = fields.quantity("m/s", "fastest that a target moves", above=0)
    max_acceleration: float = fields.quantity("m/s^2", "what a target's acceleration may be", at_least=0)
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
    initial: float = fields.probability("probability that a new track is of a target", default=0.8, above=0)
    deviations: float = fields.quantity(
        "1", "how far returns may be from where they are expected, in standard deviations", default=3.0, at_least=0
    )
    appears_in: tuple[Polygon, ...] = fields.part(
        "areas outside of which no track starts; default: everywhere", default=(), tried=((),)
    )

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> Chains | None:
        """Return nothing: there was no scan yet."""
        return None

    def starts_from(self, sensor: str) -> bool:
        """Return whether it is one of `sensors`."""
        return not self.sensors or sensor in self.sensors

    def predict(
        self, memory: Chains | None, estimator: Estimator[Any], dt: float, rng: np.random.Generator
    ) -> Chains | None:
        """Return the returns of the scan before and the chains, `dt` longer ago."""
        return None if memory is None else Chains(memory.last.later(dt), memory.mean, memory.cov)

    def update(
        self, memory: Chains | None, estimator: Estimator[Any], sensor: Sensor, detections: Detections, claimed: Array,
        p_gate: float,
    ) -> Chains:  # fmt: skip
        """Return this scan's returns that no track claims, and the chains that end there."""
        if detections.time is not None:
            told = (
                "'three_point' takes all returns of a scan to be of one time: use 'from_returns', or leave their times out"
            )
            raise ScanRefused(f"birth: {told}")
        rows, d = unclaimed(detections, claimed, self.claimed), len(sensor.observes)
        spot = spots(sensor, detections, rows) if len(rows) else Gaussian(np.zeros((0, d)), np.zeros((0, d, d)))
        last = Waiting(spot.mean, spot.cov, np.asarray(0.0))
        if memory is None or memory.last.idle or not len(rows):
            return Chains(last, np.zeros((0, 2 * d)), np.zeros((0, 2 * d, 2 * d)))
        # No sensor's name here: whoever is too fast for its sensor is found when a third return comes.
        limit = fastest(max(self.max_speed, *self.sensor_speeds.values(), 0.0), {}, self.class_speeds, "", detections)
        _, moving = pairs(spot, memory.last, limit[rows], self.deviations)
        return Chains(last, moving.mean, moving.cov)

    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each return that goes on as a chain does."""
        rows, state, position = unclaimed(detections, claimed, self.claimed), estimator.state, sensor.observes
        idle = found is None or found.last.idle or not len(found.mean) or not len(rows)
        if idle and len(claimed):
            return Newborn.none(len(state))
        velocity_axes(position, self.spread, state)
        spot = spots(sensor, detections, rows)
        if idle:
            return Newborn.none(len(state))
        limit = fastest(self.max_speed, self.sensor_speeds, self.class_speeds, name, detections)[rows]
        near, moving = self._third(spot, found, limit)
        prior = in_state(moving, position, self.spread, state)
        return within(self.appears_in, Newborn(rows[near], prior, np.full(len(near), self.initial)), state)

    def _third(self, now: Gaussian, found: Chains, limit: Array) -> tuple[Array, Gaussian]:
        """Return which positions (k, d) go on as a chain does, and position and velocity (j, 2d) of these by all three."""
        d, dt, a = now.mean.shape[-1], float(found.last.ago), self.max_acceleration
        F = np.eye(2 * d) + np.diag(np.full(d, dt), d)
        mean, push = found.mean @ F.T, np.repeat([0.5 * a * dt * dt, a * dt], d)
        cov = F @ found.cov @ F.T + np.diag(push**2)
        S = cov[None, :, :d, :d] + now.cov[:, None]
        off = now.mean[:, None] - mean[None, :, :d]
        distance = np.sum(off * np.linalg.solve(S, off[..., None])[..., 0], axis=-1)
        chain = np.argmin(distance, axis=-1)
        near = np.flatnonzero(np.min(distance, axis=-1) <= self.deviations**2)
        chain = chain[near]
        gain = cov[chain][..., :d] @ np.linalg.inv(S[near, chain])
        after = mean[chain] + (gain @ off[near, chain][..., None])[..., 0]
        left = cov[chain] - gain @ cov[chain][..., :d, :]
        left = 0.5 * (left + np.swapaxes(left, -1, -2))
        noise = np.sqrt(np.linalg.eigvalsh(left[:, d:, d:])[..., -1])
        slow = np.linalg.norm(after[:, d:], axis=-1) <= limit[near] + self.deviations * noise
        return near[slow], Gaussian(after[slow], left[slow])
