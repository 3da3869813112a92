"""The loop: predict, evaluate, gate, associate, update, and the tracks' lifecycle, for all tracks at once."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, final

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from vedette import fields, kernels
from vedette.roles import Associator, Estimator, Lifecycle, Sensor
from vedette.space import Array, Mask, Space, SpaceError
from vedette.tracking import trees
from vedette.tracking.gate import Gate, SensorGate
from vedette.tracking.validation import admitted
from vedette.types import Detections, Gaussian, Scan
from vedette.values import maker


@frozen(eq=False)
class State:
    """All that a tracker knows after a scan. `t` tracks, oldest first; `*b` runs in lock-step.

    ids (t,), confirmed (*b, t), existence (*b, t); weights (*b, t, 1+k) and squared distances (*b, t, k) say how the tracks
    used the last scan.
    """

    time: float
    belief: Any
    memory: Any
    ids: NDArray[np.int64]
    existence: Array
    confirmed: Mask
    weights: Array
    distances: Array
    born: int
    rng: np.random.Generator

    @property
    def hit(self) -> Array:
        """The weight of having been detected in the last scan (*b, t)."""
        return 1.0 - self.weights[..., 0]

    @property
    def nis(self) -> Array:
        """The squared distance weighted over the last scan's returns (*b, t)."""
        total: Array = np.sum(self.weights[..., 1:] * self.distances, axis=-1)
        return total


new_state = maker(State)


def _check_sensors(sensors: dict[str, Sensor], estimator: Estimator[Any]) -> None:
    if not sensors:
        raise ValueError("sensors: must hold at least one sensor, got none")
    for name, sensor in sensors.items():
        try:
            estimator.state.locate(sensor.observes)
        except SpaceError as error:
            raise ValueError(f"sensors.{name}: looks at an axis that the estimator lacks: {error}") from None
        if reason := estimator.refuses(sensor):
            raise ValueError(f"sensors.{name}: {reason}")


def _checked_starts(sensors: dict[str, Sensor], lifecycle: Lifecycle, state: Space) -> Iterator[str]:
    """The sensors whose returns may start tracks; rehearses the start of none, so that one that cannot work is told now."""
    for name, sensor in sensors.items():
        if lifecycle.starts(name, np.zeros(1)).any():
            try:
                lifecycle.prior(sensor.invert(np.zeros((0, len(sensor.measurement)))), sensor.observes, state)
            except NotImplementedError as error:
                raise ValueError(f"lifecycle.sensors: must not hold {name!r}: {error}") from None
            except ValueError as error:
                raise ValueError(f"lifecycle.{error}") from None
            yield name


@final
@frozen
class Tracker:
    """A tracker composed of parts. It is immutable: `start` gives a state, `step` takes one scan and gives the next.

    >>> import vedette
    >>> tracker = vedette.build({
    ...     "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    ...     "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    ...     "associator": {"kind": "pda"},
    ...     "lifecycle": {"kind": "m_of_n", "spread": {"vx": 10.0, "vy": 10.0}},
    ... })
    >>> state = tracker.start(seed=1)
    >>> state = tracker.step(state, vedette.Scan(0.0, "radar", vedette.Detections.of([[100.0, 50.0]])))
    >>> tracker.estimate(state).mean.tolist()
    [[100.0, 50.0, 0.0, 0.0]]
    """

    estimator: Estimator[Any] = fields.part("the belief about each track and how it changes")
    sensors: dict[str, Sensor] = fields.part("name to sensor: how scans of that name are to be read")
    associator: Associator = fields.part("which return belongs to which track")
    lifecycle: Lifecycle = fields.part("when tracks begin, count as real, and end")
    gate: Gate = fields.part("which returns a track considers", default=Gate())
    _sensor_gates: dict[str, SensorGate] = field(init=False, repr=False, eq=False)
    _starters: frozenset[str] = field(init=False, repr=False, eq=False)

    @_sensor_gates.default
    def _gates_of_sensors(self) -> dict[str, SensorGate]:
        for name, sensor in self.sensors.items():
            if sensor.optional and self.gate.clutter != "sensor":
                raise ValueError(f"gate.clutter: must be 'sensor', as returns of {name!r} may lack components")
        _check_sensors(self.sensors, self.estimator)
        return {name: self.gate.for_sensor(sensor) for name, sensor in self.sensors.items()}

    @_starters.default
    def _sensors_that_start_tracks(self) -> frozenset[str]:
        return frozenset(_checked_starts(self.sensors, self.lifecycle, self.estimator.state))

    @property
    def state(self) -> Space:
        """The axes of the estimates."""
        return self.estimator.state

    def start(self, given: Gaussian | None = None, time: float = -np.inf, seed: int | np.random.Generator = 0) -> State:
        """The state before the first scan: no tracks, or those with the `given` prior (*b, t, n) at `time` in s."""
        rng = np.random.default_rng(seed)
        n = len(self.state)
        prior = given if given is not None else Gaussian(np.zeros((0, n)), np.zeros((0, n, n)))
        shape = prior.mean.shape[:-1]
        memory, existence = self.lifecycle.newborn(shape[-1])
        return State(
            time=time,
            belief=self.estimator.start(prior, self.state, rng),
            memory=memory,
            ids=np.arange(shape[-1]),
            existence=np.broadcast_to(existence, shape),
            confirmed=np.full(shape, given is not None),
            weights=np.ones((*shape, 1)),
            distances=np.zeros((*shape, 0)),
            born=shape[-1],
            rng=rng,
        )

    def step(self, state: State, scan: Scan) -> State:
        """The state after one scan; ScanRefused, with the state as it was, if the scan cannot be taken."""
        observed = admitted(scan, self._sensor_gates, state.time)
        sensor_gate = self._sensor_gates[scan.sensor]
        sensor = sensor_gate.sensor
        if scan.pose is not None:
            sensor = sensor.at(scan.pose)
        estimator, lifecycle, p_gate = self.estimator, self.lifecycle, self.gate.probability
        dt = scan.time - state.time if state.time != -np.inf else 0.0
        belief = estimator.predict(state.belief, dt, state.rng)
        innovation = estimator.evaluate(belief, sensor, observed, p_gate)
        memory, confirmed, existence, permanent = state.memory, state.confirmed, state.existence, lifecycle.permanent
        if not permanent:
            existence = lifecycle.survive(existence, dt)
        exclusive, loglik = self.associator.exclusive, innovation.loglik
        if isinstance(observed, Detections):
            scores = self.gate.scores(innovation, sensor, observed, existence, sensor_gate)
            weights = self.associator.associate(
                scores, None if observed.evidence is None else observed.evidence[..., None, :]
            )
            if not permanent:
                hit, existence, p_detect = kernels.existence(scores, weights, existence, loglik, p_gate, exclusive)
        else:  # all tracks may see themselves in one frame, so each is associated as if it were alone
            scores = self.gate.frame_scores(innovation, existence, sensor_gate.threshold)[..., None, :]
            alone = self.associator.associate(scores, None)
            each = kernels.existence(scores, alone, existence[..., None], loglik[..., None, :], p_gate, exclusive)
            hit, existence, p_detect = (part[..., 0] for part in each)
            weights = alone[..., 0, :]
        if not permanent:
            memory, confirmed, alive = lifecycle.review(memory, existence, hit, p_detect)
        after = new_state(
            scan.time,
            estimator.update(belief, innovation, weights),
            memory,
            state.ids,
            existence,
            confirmed,
            weights,
            innovation.nis,
            state.born,
            state.rng,
        )
        if not permanent and np.count_nonzero(alive) < alive.size:
            after = _keep(after, alive)
        if scan.sensor not in self._starters or not isinstance(observed, Detections):
            return after
        claimed = 1.0 - np.prod(1.0 - weights[..., 1:], axis=-2)
        starts = lifecycle.starts(scan.sensor, claimed) & observed.valid
        if observed.missing is not None:
            starts = starts & ~observed.missing.any(axis=-1)
        return self._begin(after, sensor, observed, starts) if starts.any() else after

    def estimate(self, state: State) -> Gaussian:
        """Mean (*b, t, n) and covariance (*b, t, n, n) of every track over `self.state`."""
        return self.estimator.moments(state.belief)

    def _begin(self, state: State, sensor: Sensor, detections: Detections, starts: Mask) -> State:
        """Join tracks that start at the returns `starts` (k,)."""
        noise = None if detections.noise is None else detections.noise[starts]
        spot = sensor.invert(detections.z[starts], noise)
        prior = self.lifecycle.prior(spot, sensor.observes, self.state)
        count = len(prior.mean)
        memory, existence = self.lifecycle.newborn(count)
        belief = self.estimator.start(prior, self.state, state.rng)
        weights = np.zeros((count, state.weights.shape[-1]))
        weights[range(count), 1 + np.flatnonzero(starts)] = 1.0
        return evolve(
            state,
            belief=trees.join(state.belief, belief, 0),
            memory=trees.join(state.memory, memory, 0),
            ids=np.concatenate([state.ids, state.born + np.arange(count)]),
            existence=np.concatenate([state.existence, existence]),
            confirmed=np.concatenate([state.confirmed, np.zeros(count, dtype=bool)]),
            weights=np.concatenate([state.weights, weights]),
            distances=np.concatenate([state.distances, np.zeros((count, state.distances.shape[-1]))]),
            born=state.born + count,
        )


def _keep(state: State, alive: Mask) -> State:
    """The state without the tracks that ended."""
    if alive.ndim > 1:
        raise ValueError("lifecycle: runs in lock-step keep their tracks; use one that ends none, such as 'single_target'")
    names = ("belief", "memory", "ids", "existence", "confirmed", "weights", "distances")
    return evolve(state, **{name: trees.take(getattr(state, name), alive, 0) for name in names})
