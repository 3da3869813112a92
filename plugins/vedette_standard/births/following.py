"""The common part of births at returns that follow earlier ones, at speeds which targets have."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from attrs import astuple, frozen

from vedette import Array, Birth, Detections, Estimator, Gaussian, Indices, Mask, Newborn, ScanRefused, Sensor, Space, fields
from vedette_standard.births.one_point import unclaimed, within
from vedette_standard.regions import Polygon

SEEN = 0.1
"""A place that a sensor looks at: a target there is detected with this probability or more; as `m_of_n` counts a look."""

WAITS, KEPT, LONGEST, NEVER = 16, 1000, 600.0, -(2**62)
"""Scans of other places through which a return surely waits for one that can follow it; how many of the newest wait on, and
for how many s, as one sensor looks once a minute beside another that does every second; `left` of what does not wait."""


@frozen(eq=False)
class Waiting:
    """What waits for a return that follows: k positions, maybe with velocities, (k, p) and (k, p, p), `ago` (k,) s before.

    left (k,): the scans of other places that it surely outlasts.
    """

    mean: Array
    cov: Array
    ago: Array
    left: Indices

    @classmethod
    def now(cls, found: Gaussian, seen: Mask) -> Waiting:
        """Return what waits from now on; what its own sensor should not have `seen` (k,) outlasts nothing."""
        return cls(found.mean, found.cov, np.zeros(len(found.mean)), np.where(seen, WAITS, NEVER))

    def later(self, dt: float) -> Waiting:
        """Return the same, `dt` longer ago."""
        return Waiting(self.mean, self.cov, self.ago + dt, self.left)

    def of(self, some: Any) -> Waiting:
        """Return some of it."""
        return Waiting(self.mean[some], self.cov[some], self.ago[some], self.left[some])

    @property
    def earlier(self) -> Waiting:
        """What was there before this moment."""
        past = self.ago > 0
        return self if past.all() else self.of(past)

    def outlasting(self, sensor: Sensor) -> Waiting:
        """Return what a scan leaves to wait, as its sensor does not look there."""
        if not len(self.mean):
            return self
        longer = (self.left > NEVER) & (np.arange(len(self.left), 0, -1) <= KEPT) & (self.ago <= LONGEST)
        some = ((self.left > 0) | longer) & ~seen(sensor, self.mean[:, : len(position_of(sensor))])
        kept = self.of(some if some.any() else slice(0))
        return Waiting(kept.mean, kept.cov, kept.ago, kept.left - 1)

    def and_now(self, new: Waiting) -> Waiting:
        """Return what waited and what waits from now on."""
        if not len(self.mean):
            return new
        return Waiting(*(np.concatenate(both) for both in zip(astuple(self), astuple(new), strict=True)))


def position_of(sensor: Sensor) -> Space:
    """Return the axes that a sensor observes but for velocities of others, as a Doppler radar's."""
    names = sensor.observes.names
    return Space(tuple(axis for axis in sensor.observes.axes if not (axis.name[0] == "v" and axis.name[1:] in names)))


def seen(sensor: Sensor, spots: Array) -> Mask:
    """Return which positions (k, d) a sensor looks at, if what is there does not move."""
    x = np.zeros((len(spots), len(sensor.observes)))
    x[:, sensor.observes.locate(position_of(sensor))] = spots
    return np.broadcast_to(sensor.detects(x) >= SEEN, len(spots))


def spots(sensor: Sensor, detections: Detections, rows: Indices) -> Gaussian:
    """Return the positions (k, d) that some returns give."""
    own = sensor.observes.locate(position_of(sensor))
    given = sensor.invert(detections.z[rows], detections.noise_of(rows))
    return Gaussian(given.mean[:, own], given.cov[:, own][..., own])


def none_follow(axes: int) -> tuple[Indices, Gaussian]:
    """Return no positions, of so many axes, that follow others."""
    return np.zeros(0, dtype=np.intp), Gaussian(np.zeros((0, 2 * axes)), np.zeros((0, 2 * axes, 2 * axes)))


def pairs(now: Gaussian, before: Waiting, limit: Array, deviations: float) -> tuple[Indices, Gaussian]:
    """Return which positions (k, d) follow one of the scan before, and position and velocity (j, 2d) of these.

    Two-point differencing: z2 and z1, dt apart, give z2 and (z2 - z1) / dt, with the covariances R2, (R1 + R2) / dt^2 and
    R2 / dt between them. limit (k,): the fastest, beyond which `deviations` of the noise are allowed; the nearest counts.
    """
    if not len(before.mean) or not len(now.mean):
        return none_follow(now.mean.shape[-1])
    from scipy.spatial import KDTree

    apart, nearest = map(np.asarray, KDTree(before.mean).query(now.mean))
    noise = np.sqrt(np.linalg.eigvalsh(now.cov + before.cov[nearest])[..., -1])
    near = np.flatnonzero(apart <= limit * before.ago[nearest] + deviations * noise)
    nearest, spot = nearest[near], Gaussian(now.mean[near], now.cov[near])
    d, dt = spot.mean.shape[-1], before.ago[nearest]
    mean = np.concatenate([spot.mean, (spot.mean - before.mean[nearest]) / dt[:, None]], axis=-1)
    cov = np.empty((len(near), 2 * d, 2 * d))
    cov[:, :d, :d] = spot.cov
    cov[:, :d, d:] = cov[:, d:, :d] = spot.cov / dt[:, None, None]
    cov[:, d:, d:] = (spot.cov + before.cov[nearest]) / dt[:, None, None] ** 2
    return near, Gaussian(mean, cov)


def in_state(found: Gaussian, position: Space, spread: Mapping[str, float], state: Space) -> Gaussian:
    """Return positions and velocities (j, 2d) as beliefs over a state: other axes are 0 with deviations of `spread`."""
    own, n = [*state.locate(position), *velocity_axes(position, spread, state)], len(state)
    mean, cov = np.zeros((len(found.mean), n)), np.zeros((len(found.mean), n, n))
    cov[:, range(n), range(n)] = [spread.get(axis, 0.0) ** 2 for axis in state.names]
    mean[:, own] = found.mean
    cov[:, np.array(own)[:, None], own] = found.cov
    return Gaussian(mean, cov)


def velocity_axes(position: Space, spread: Mapping[str, float], state: Space) -> list[int]:
    """Return the axes of the velocity, one for each of the position; ValueError if the state lacks one or has others."""
    names = [f"v{name}" for name in position.names]
    if lacking := [name for name in names if name not in state]:
        own = ", ".join(position.names)
        raise ValueError(
            f"sensors: must observe positions alone, whose velocities are in the state: of {own} it lacks {lacking[0]!r}"
        )
    if lacking := [name for name in state.names if name not in {*names, *position.names, *spread}]:
        raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
    return [state.names.index(name) for name in names]


@frozen
class Following(Birth):
    """A birth whose tracks start at returns that follow those of scans before; a kind says by `followers` which do.

    It remembers, for each set of axes in which sensors give positions, what waits there for another scan: until a sensor
    looks at the place again. Scans that see other places, or no positions, change nothing. Range rates are not used.
    """

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
        "1", "how far returns may be from where a target can be, in standard deviations", default=3.0, at_least=0
    )
    appears_in: tuple[Polygon, ...] = fields.part(
        "areas outside of which no track starts; default: everywhere", default=(), tried=((),)
    )

    @abstractmethod
    def followers(self, now: Gaussian, memory: Any, limit: Array) -> tuple[Indices, Gaussian]:
        """Return which positions (k, d) follow what the memory holds, and position and velocity (j, 2d) of these.

        limit (k,): the fastest that each may be.
        """

    @abstractmethod
    def remembered(self, memory: Any, now: Waiting, sensor: Sensor, limit: Array) -> Any:
        """Return what waits after a scan of the returns `now` that no track claims; memory: before it, None for nothing."""

    def initial_memory(self, estimator: Estimator[Any], rng: np.random.Generator) -> None:
        """Return nothing: there was no scan yet."""

    def predict(self, memory: Any, estimator: Estimator[Any], dt: float, rng: np.random.Generator) -> Any:
        """Return the memory, `dt` longer ago."""
        return None if memory is None else {axes: waiting.later(dt) for axes, waiting in memory.items()}

    def update(
        self, memory: Any, estimator: Estimator[Any], sensor: Sensor, detections: Detections, claimed: Array, p_gate: float
    ) -> Any:
        """Return the memory after a scan: with its returns that no track claims, if they give positions."""
        rows, axes = self.left_over(detections, claimed), position_of(sensor).names
        if any(f"v{name}" not in estimator.state for name in axes):
            return memory
        try:
            spot = spots(sensor, detections, rows)
        except NotImplementedError:
            return memory
        # No sensor's name here: whoever is too fast for its sensor is found when a last return comes.
        limit = self.limit(detections, max(self.max_speed, *self.sensor_speeds.values(), 0.0))[rows]
        before, key = memory or {}, " ".join(axes)
        now = Waiting.now(spot, seen(sensor, spot.mean))
        return {**before, key: self.remembered(before.get(key), now, sensor, limit)}

    def begin(
        self, found: Any, estimator: Estimator[Any], sensor: Sensor, name: str, detections: Detections, claimed: Array
    ) -> Newborn:
        """Return a track at each return that follows those of the scans before."""
        rows, state, position = unclaimed(detections, claimed, self.claimed), estimator.state, position_of(sensor)
        memory = None if found is None else found.get(" ".join(position.names))
        idle = memory is None or not len(rows)
        if idle and len(claimed):
            return Newborn.none(len(state))
        velocity_axes(position, self.spread, state)
        spot = spots(sensor, detections, rows)
        if idle:
            return Newborn.none(len(state))
        near, moving = self.followers(
            spot, memory, self.limit(detections, self.sensor_speeds.get(name, self.max_speed))[rows]
        )
        prior = in_state(moving, position, self.spread, state)
        return within(self.appears_in, Newborn(rows[near], prior, np.full(len(near), self.initial)), state)

    def left_over(self, detections: Detections, claimed: Array) -> Indices:
        """Return the returns that no track claims; ScanRefused if they have times of their own."""
        if detections.time is not None:
            told = (
                f"{self.kind!r} takes all returns of a scan to be of one time: use 'from_returns', or leave their times out"
            )
            raise ScanRefused(f"birth: {told}, as scans.own_times = false does of a stream")
        return unclaimed(detections, claimed, self.claimed)

    def limit(self, detections: Detections, most: float) -> Array:
        """Return the fastest (k,) that the source of each return may be: `most`, or its class's, if that is lower."""
        limit, classes = np.full(len(detections.z), most), self.class_speeds
        if not len(classes) or detections.identity is None:
            return limit
        known = (detections.identity >= 0) & (detections.identity < len(classes))
        return np.where(known, np.minimum(limit, classes[np.where(known, detections.identity, 0)]), limit)
