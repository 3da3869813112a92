"""The loop: predict, evaluate, gate, associate, update, and the tracks' births and ends, for all tracks at once."""

from __future__ import annotations

from functools import partial
from typing import Any, final

import numpy as np
from attrs import field, frozen

from vedette import fields, kernels
from vedette.display import named, parameters_html
from vedette.filters.motion import predicted
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator, Estimator, Sensor
from vedette.sampling.generators import NO_DRAWS
from vedette.sampling.seeds import Seed, Seeds
from vedette.space import Array, Space
from vedette.supporting import Birth, Lifecycle
from vedette.tracking import births, branching, sparse
from vedette.tracking.ceiling import FEW, is_sparse
from vedette.tracking.faults import explain, explained
from vedette.tracking.gate import Gate, SensorGate
from vedette.tracking.lineage import Gates
from vedette.tracking.mistaken import check_given, check_predicted, check_state, time_from, time_of_start
from vedette.tracking.spread import check_spread, largest_deviation
from vedette.tracking.state import State, new_state
from vedette.tracking.validation import admitted, check_forwarding, check_sensors, checked_prior
from vedette.types import Detections, Frame, Gaussian, Recording, Review, Scan, new_gaussian

NOTHING = None, None, None
"""The result of a birth without a model of undetected targets: no memory, no rate, nothing found."""


def _shown(estimate: Gaussian) -> Gaussian:
    """Return an estimate that nobody can write into: its arrays may be those of the state."""
    mean, cov = estimate.mean[...], estimate.cov[...]
    mean.setflags(write=False)
    cov.setflags(write=False)
    return new_gaussian(mean, cov)


@final
@frozen(repr=False)
class Tracker:
    """A tracker composed of parts. It is immutable: `start` returns a state, `step` takes one scan and returns the next.

    >>> import vedette
    >>> tracker = vedette.build({
    ...     "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    ...     "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    ...     "associator": {"kind": "pda"},
    ...     "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    ...     "lifecycle": {"kind": "m_of_n"},
    ... })
    >>> state = tracker.start(seed=1)
    >>> state = tracker.step(state, vedette.Scan(0.0, "radar", vedette.Detections.of([[100.0, 50.0]])))
    >>> tracker.estimate(state).mean.tolist()
    [[100.0, 50.0, 0.0, 0.0]]
    """

    estimator: Estimator[Any] = fields.part("the belief about each track and how it changes")
    sensors: dict[str, Sensor] = fields.part("name to sensor: how scans of that name are read")
    associator: Associator = fields.part("which return belongs to which track")
    lifecycle: Lifecycle = fields.part("when tracks are confirmed, and end")
    birth: Birth | None = fields.part("how tracks start; none: only those given to `start`", default=None)
    gate: Gate = fields.part("which returns a track considers", default=Gate())
    _sensor_gates: dict[str, SensorGate] = field(init=False, repr=False, eq=False)
    starters: frozenset[str] = field(init=False, repr=False, eq=False)
    _models_unseen: bool = field(init=False, repr=False, eq=False)
    _asks_birth: bool = field(init=False, repr=False, eq=False)
    _approximates: bool = field(init=False, repr=False, eq=False)
    _draws: bool = field(init=False, repr=False, eq=False)
    _reframes: bool = field(init=False, repr=False, eq=False)
    _branches: bool = field(init=False, repr=False, eq=False)

    @_sensor_gates.default
    def _gates_of_sensors(self) -> dict[str, SensorGate]:
        def gates() -> dict[str, SensorGate]:
            check_forwarding(self.estimator)
            check_sensors(self.sensors, self.estimator, self.gate)
            return {name: self.gate.for_sensor(sensor) for name, sensor in self.sensors.items()}

        return explained(self, gates)

    @starters.default
    def _sensors_that_start_tracks(self) -> frozenset[str]:
        def starting() -> frozenset[str]:
            births.check_existence(self.birth, self.lifecycle)
            check_spread(self.lifecycle, self.estimator.state)
            return frozenset(births.starters(self.birth, self.sensors, self.estimator))

        return explained(self, starting)

    @_models_unseen.default
    def _birth_keeps_a_memory(self) -> bool:
        return self.birth is not None and self.birth.models_unseen

    @_asks_birth.default
    def _birth_takes_part_in_scans(self) -> bool:
        return bool(self.starters) or self._models_unseen

    @_approximates.default
    def _counts_approximate_weights(self) -> bool:
        return self.associator.approximates

    @_draws.default
    def _draws_numbers(self) -> bool:
        return self.estimator.traits.draws or (self.birth is not None and self.birth.draws)

    @_reframes.default
    def _turns_its_frame(self) -> bool:
        return self.estimator.traits.reframes

    @_branches.default
    def _keeps_hypotheses(self) -> bool:
        if not isinstance(self.associator, HypothesisAssociator):
            return False
        branching.check_parts(self.associator, self.estimator, self.lifecycle, self.sensors)
        return True

    def __repr__(self) -> str:
        parts = (self.estimator, self.associator, self.birth, self.lifecycle)
        return f"Tracker({', '.join(map(named, parts))}; sensors {named(self.sensors)})"

    def _repr_html_(self) -> str:
        return parameters_html(self)

    @property
    def state(self) -> Space:
        """The axes of the estimates."""
        return self.estimator.state

    @property
    def starts_tracks(self) -> bool:
        """Whether returns may start tracks; otherwise the tracks given before the first scan are all."""
        return bool(self.starters)

    def given(self, recording: Recording) -> Gaussian | None:
        """Return the tracks that the birth has before the first scan of a recording, or None; ValueError with its place."""
        if self.birth is None:
            return None
        try:
            return self.birth.given(self.state, recording)
        except ValueError as error:
            raise ValueError(f"birth.{error}") from None

    def start(
        self,
        given: Gaussian | None = None,
        time: float = -np.inf,
        seed: int | np.random.Generator | np.random.SeedSequence | Seed | Seeds = 0,
    ) -> State:
        """Return the state before the first scan: the tracks with the `given` prior (*b, t, n) at `time` in s.

        Without it, the tracks that the birth has before any recording is seen: none, unless it says otherwise.
        """
        time = time_of_start(time)
        source = Seed.of(seed)
        rng = source.generator(0) if self._draws else NO_DRAWS
        n = len(self.state)
        prior = self.given(Recording(())) if given is None else checked_prior(given, n)
        confirmed = prior is not None
        if prior is None:
            prior = Gaussian(np.zeros((0, n)), np.zeros((0, n, n)))
        shape = prior.mean.shape[:-1]
        try:
            belief, memory = self.estimator.start(prior, self.state, rng), self.lifecycle.start(np.ones(shape[-1]))
            leaves = None
            if isinstance(self.associator, HypothesisAssociator):
                leaves = branching.initial_leaves(self.associator, belief, memory, shape)
            unseen = self.birth.initial_memory(self.estimator, rng) if self.birth and self._models_unseen else None
        except Exception as error:
            explain(error, self, partial(self.start, given, time, source))
            raise
        return State(
            time=time,
            belief=belief,
            memory=memory,
            unseen=unseen,
            ids=np.arange(shape[-1]),
            existence=np.ones(shape),
            confirmed=np.full(shape, confirmed),
            weights=np.ones((*shape, 1)),
            distances=np.zeros((*shape, 0)),
            born=shape[-1],
            approximated=0,
            seed=source,
            steps=1,
            leaves=leaves,
        )

    def step(self, state: State, scan: Scan) -> State:
        """Return the state after one scan; ScanRefused, with the state as it was, if the scan cannot be taken."""
        try:
            observed = admitted(scan, self._sensor_gates, state.time)
        except AttributeError:
            check_state(state)
            raise
        many = scan.detections.z.size > FEW and is_sparse(self, state, scan)
        try:
            gate, estimator, lifecycle = self._sensor_gates[scan.sensor], self.estimator, self.lifecycle
            sensor = gate.sensor if scan.pose is None else gate.sensor.at(scan.pose)
            dt = scan.time - state.time if state.time != -np.inf else 0.0

            rng = state.seed.generator(state.steps) if self._draws else NO_DRAWS
            branches = self._branches
            rows = state.leaves if branches else state
            belief = rows.belief
            if self._reframes and dt > 0:
                belief = estimator.reframe(belief, estimator.moments(belief))
            belief = estimator.predict(belief, dt, rng)
            existence = rows.existence if lifecycle.certain else lifecycle.predict(rows.existence, dt)
            unseen, rate, found = births.reveal(self, state, dt, sensor, observed, rng) if self._models_unseen else NOTHING

            if many and isinstance(observed, Detections):
                it = sparse.Predicted(belief, existence, sensor, gate, observed, rate, unseen, found)
                return sparse.concluded(self, state, scan, dt, it, sparse.meet(self, it), rng)
            innovation = estimator.evaluate(belief, sensor, observed, self.gate.probability)
            scores = self.gate.scores(innovation, sensor, observed, existence, gate, rate)
            if branches and isinstance(observed, Detections):
                evaluated = branching.Evaluated(belief, existence, unseen, found, innovation, scores)
                return branching.grown(self, state, scan, observed, sensor, evaluated, dt, rng)
            plain = gate.axes and observed.evidence is None
            weights = self.associator.associate(scores, None) if plain else self._associate(scores, observed)
            used = weights if lifecycle.certain else kernels.given_existence(weights, scores, innovation.loglik, existence)

            approximated = self._approximated(state, scores, observed) if self._approximates else state.approximated
            after = new_state(
                scan.time, estimator.update(belief, innovation, used), state.memory, unseen, state.ids, existence,
                state.confirmed, weights, innovation.nis, state.born, approximated, state.seed, state.steps + 1,
                None, None, None,
            )  # fmt: skip
            if not lifecycle.permanent:
                seen = kernels.existence(
                    scores, weights, existence, innovation.loglik, self.gate.probability,
                    self.associator.exclusive or not gate.axes,
                )  # fmt: skip
                gates = Gates(state.ids, state.confirmed, state.born, state.ids, scores, None, None) if gate.axes else None
                after = self.reviewed(after, gates, dt, *seen)
            if self._asks_birth:
                after = births.begin(self, after, found, sensor, scan.sensor, observed, weights, rng)
            return after
        except Exception as error:
            check_given(state, self.start, observed)
            explain(error, self, partial(self.step, state, scan), self.start)
            raise

    def predict(self, state: State, time: float) -> Any:
        """Return the belief at `time` in s, as `step` predicts it for a scan of that time."""
        rng = state.seed.generator(state.steps) if self._draws else NO_DRAWS
        try:
            return predicted(self.estimator, state.belief, time - state.time if state.time != -np.inf else 0.0, rng)
        except Exception as error:
            check_predicted(state, time)
            explain(error, self, partial(self.predict, state, time))
            raise

    def sensor_of(self, scan: Scan) -> Sensor:
        """Return the sensor of a scan, standing where the scan says that it stood."""
        sensor = self.sensors[scan.sensor]
        return sensor if scan.pose is None else sensor.at(scan.pose)

    def estimate(self, state: State, time: float | None = None) -> Gaussian:
        """Return mean (*b, t, n) and covariance (*b, t, n, n) of every track over `self.state`: at `time` in s, or now."""
        check_state(state)
        belief = state.belief if time is None else self.predict(state, time_from(state, time))
        try:
            return _shown(self.estimator.moments(belief))
        except Exception as error:
            explain(error, self, partial(self.estimator.moments, belief))
            raise

    def _approximated(self, state: State, scores: Array, observed: Detections | Frame) -> int:
        """Return how many weights were not exact so far; a frame's are."""
        more = 0 if isinstance(observed, Frame) else np.count_nonzero(self.associator.approximated(scores))
        return state.approximated + int(more)

    def _associate(self, scores: Array, observed: Detections | Frame) -> Array:
        """Return the weights (*b, t, 1+k); each track is alone with a frame, as several may appear in it."""
        if isinstance(observed, Frame):
            alone: Array = self.associator.associate(scores[..., None, :], None)[..., 0, :]
            return alone
        evidence = observed.evidence
        return self.associator.associate(scores, None if evidence is None else evidence[..., None, :])

    def reviewed(self, state: State, gates: Gates | None, dt: float, hit: Array, existence: Array, p_detect: Array) -> State:
        """Return the state with its tracks judged by what a scan says of them, without those that ended."""
        spread = largest_deviation(self.estimate(state), self.state) if self.lifecycle.needs_spread else None
        memory, confirmed, alive = self.lifecycle.review(state.memory, Review(dt, existence, hit, p_detect, spread))
        after = new_state(
            state.time, state.belief, memory, state.unseen, state.ids, existence, confirmed, state.weights, state.distances,
            state.born, state.approximated, state.seed, state.steps, None, state.returns, gates,
        )  # fmt: skip
        return after if np.count_nonzero(alive) == alive.size else births.ended(self, after, alive)
