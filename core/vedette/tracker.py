"""The loop: predict, innovate, gate, associate, absorb, and the tracks' lifecycle, for all tracks at once."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import evolve, field, frozen
from numpy.typing import NDArray

from vedette import fields, trees
from vedette.admission import flaws
from vedette.errors import ScanRefused
from vedette.gate import Gate
from vedette.roles import Associator, Estimator, Lifecycle, Sensor
from vedette.space import Array, Mask, Space, SpaceError
from vedette.types import Detections, Gaussian, Scan


@frozen(eq=False)
class State:
    """All that a tracker knows after a scan. `t` tracks, oldest first; `*b` runs in lock-step.

    ids (t,), confirmed (*b, t), existence (*b, t); weights (*b, t, 1+k), nis and hit (*b, t) say how the tracks used the
    last scan: nis is the squared distance weighted over the returns, hit the weight of having been detected.
    """

    time: float
    belief: Any
    memory: Any
    ids: NDArray[np.int64]
    existence: Array
    confirmed: Mask
    weights: Array
    nis: Array
    hit: Array
    born: int
    rng: np.random.Generator


def _check_sensors(sensors: dict[str, Sensor], estimator: Estimator[Any]) -> None:
    if not sensors:
        raise ValueError("sensors: must hold at least one sensor, got none")
    for name, sensor in sensors.items():
        try:
            estimator.state.locate(sensor.looks_at)
        except SpaceError as error:
            raise ValueError(f"sensors.{name}: looks at an axis that the estimator lacks: {error}") from None
        if reason := estimator.refuses(sensor):
            raise ValueError(f"sensors.{name}: {reason}")


def _check_starts(sensors: dict[str, Sensor], lifecycle: Lifecycle, state: Space) -> None:
    """Rehearse the start of no tracks at all, so that one that cannot work is told now."""
    for name, sensor in sensors.items():
        if lifecycle.starts(name, np.zeros(1)).any():
            try:
                lifecycle.prior(sensor.invert(np.zeros((0, len(sensor.measurement)))), sensor.looks_at, state)
            except NotImplementedError as error:
                raise ValueError(f"lifecycle.sensors: must not hold {name!r}: {error}") from None
            except ValueError as error:
                raise ValueError(f"lifecycle.{error}") from None


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
    _thresholds: dict[str, float] = field(init=False, repr=False, eq=False)

    @_thresholds.default
    def _gate_thresholds(self) -> dict[str, float]:
        for name, sensor in self.sensors.items():
            if sensor.optional and self.gate.clutter != "sensor":
                raise ValueError(f"gate.clutter: must be 'sensor', as returns of {name!r} may lack components")
        _check_sensors(self.sensors, self.estimator)
        _check_starts(self.sensors, self.lifecycle, self.estimator.state)
        return {name: self.gate.threshold(len(sensor.measurement)) for name, sensor in self.sensors.items()}

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
            nis=np.zeros(shape),
            hit=np.zeros(shape),
            born=shape[-1],
            rng=rng,
        )

    def step(self, state: State, scan: Scan) -> State:
        """The state after one scan; ScanRefused, with the state as it was, if the scan cannot be taken."""
        if problems := flaws(scan, self.sensors, state.time):
            raise ScanRefused("; ".join(map(str, problems)))
        sensor, seen = self.sensors[scan.sensor], scan.detections
        if scan.pose is not None:
            sensor = sensor.at(scan.pose)
        if not seen.valid.all():  # so that nothing in the padding can reach a sum, not even as 0 * nan
            seen = evolve(seen, z=np.where(seen.valid[..., None], seen.z, 0.0))
        if seen.missing is not None:
            seen = evolve(seen, z=np.where(seen.missing, 0.0, seen.z))
        estimator, dt = self.estimator, scan.time - state.time if np.isfinite(state.time) else 0.0
        belief = estimator.predict(state.belief, dt, state.rng)
        existence = self.lifecycle.survive(state.existence, dt)
        looked = seen if scan.frame is None else scan.frame
        innovation = estimator.innovate(belief, sensor, looked, self.gate.probability)
        miss = np.exp(innovation.loglik[..., 0])
        threshold = self._thresholds[scan.sensor]
        if scan.frame is None:
            scores = self.gate.scores(innovation, sensor, seen, existence, threshold)
            evidence = None if seen.evidence is None else seen.evidence[..., None, :]
            weights = self.associator.associate(scores, evidence)
            hit, existence = self._existence(scores, weights, existence, miss)
        else:  # all tracks may see themselves in one frame, so each is associated as if it were alone
            scores = self.gate.frame_scores(innovation, existence, threshold)[..., None, :]
            alone = self.associator.associate(scores, None)
            found, exists = self._existence(scores, alone, existence[..., None], miss[..., None])
            weights, hit, existence = alone[..., 0, :], found[..., 0], exists[..., 0]
        memory, confirmed, alive = self.lifecycle.review(state.memory, existence, hit, (1.0 - miss) / self.gate.probability)
        after = State(
            time=scan.time,
            belief=estimator.absorb(belief, innovation, weights),
            memory=memory,
            ids=state.ids,
            existence=existence,
            confirmed=confirmed,
            weights=weights,
            nis=np.sum(weights[..., 1:] * innovation.nis, axis=-1),
            hit=1.0 - weights[..., 0],
            born=state.born,
            rng=state.rng,
        )
        if not alive.all():
            after = _keep(after, alive)
        if scan.frame is not None:
            return after
        claimed = 1.0 - np.prod(1.0 - weights[..., 1:], axis=-2)
        starts = self.lifecycle.starts(scan.sensor, claimed) & seen.valid
        if seen.missing is not None:
            starts = starts & ~seen.missing.any(axis=-1)
        return self._begin(after, sensor, seen, starts) if starts.any() else after

    def estimate(self, state: State) -> Gaussian:
        """Mean (*b, t, n) and covariance (*b, t, n, n) of every track over `self.state`."""
        return self.estimator.moments(state.belief)

    def _existence(self, scores: Array, weights: Array, prior: Array, miss: Array) -> tuple[Array, Array]:
        """How far each track was detected, and its existence after the scan; (*b, t) both.

        Where the associator lets two tracks share a return, the older one claims it first: else a newborn track would
        live off its neighbour's returns. A hard choice says nothing of its doubt, so there existence follows from the score.
        """
        absent = 1.0 - prior + prior * miss
        unseen = np.divide(prior * miss, absent, out=np.zeros_like(absent), where=absent > 0)
        taken = weights[..., 1:]
        if not self.associator.exclusive and taken.shape[-2] > 1:
            free = np.ones_like(taken)
            free[..., 1:, :] = np.cumprod(1.0 - taken[..., :-1, :], axis=-2)
            taken = taken * free
        hit = np.sum(taken, axis=-1)
        chosen = np.sum(taken * np.exp(np.where(taken > 0, scores[..., 1:] - scores[..., :1], 0.0).clip(max=700)), axis=-1)
        sure = np.max(weights[..., 1:], axis=-1, initial=0.0) == 1.0
        seen = np.where(sure, chosen / (1.0 + chosen), hit)
        return hit, seen + (1.0 - seen) * unseen

    def _begin(self, state: State, sensor: Sensor, seen: Detections, starts: Mask) -> State:
        """Join tracks that start at the returns `starts` (k,)."""
        noise = None if seen.noise is None else seen.noise[starts]
        spot = sensor.invert(seen.z[starts], noise)
        prior = self.lifecycle.prior(spot, sensor.looks_at, self.state)
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
            nis=np.concatenate([state.nis, np.zeros(count)]),
            hit=np.concatenate([state.hit, np.ones(count)]),
            born=state.born + count,
        )


def _keep(state: State, alive: Mask) -> State:
    """The state without the tracks that ended."""
    if alive.ndim > 1:
        raise ValueError("lifecycle: runs in lock-step keep their tracks; use one that ends none, such as 'single_target'")
    names = ("belief", "memory", "ids", "existence", "confirmed", "weights", "nis", "hit")
    return evolve(state, **{name: trees.take(getattr(state, name), alive, 0) for name in names})
