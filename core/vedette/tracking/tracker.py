"""The tracker: what a scan is expected to bring meets what it brings, is associated and concluded."""

from __future__ import annotations

import math
from functools import partial
from typing import Any, final

import numpy as np
from attrs import field, frozen

from vedette import fields
from vedette.display import named, parameters_html
from vedette.errors import InputError, PluginError
from vedette.filters.motion import predicted
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator, Estimator, Sensor
from vedette.sampling.seeds import NO_DRAWS, Seed, Seeds
from vedette.space import Space
from vedette.supporting import Birth, Lifecycle
from vedette.tracking import state_data
from vedette.tracking.arguments import check_given, check_predicted, check_state, time_from, time_of_start
from vedette.tracking.association import associate
from vedette.tracking.conclusion import conclude
from vedette.tracking.expected import Expected, expect
from vedette.tracking.faults import explain, explained
from vedette.tracking.gate import Gate
from vedette.tracking.identity import Identity
from vedette.tracking.leaves import initial_leaves
from vedette.tracking.meeting import meet
from vedette.tracking.plan import Plan, planned
from vedette.tracking.registration import Registration
from vedette.tracking.state import State
from vedette.tracking.validation import admitted, checked_prior
from vedette.tracking.whole_scan import in_one_call
from vedette.types import Gaussian, Newborn, Recording, Scan, new_gaussian

NO_ONE = "nan or lacks, and no method of a component tells why in this step: `update` may have given it in one before"
"""What is told where nobody was found to blame."""


def _shown(estimate: Gaussian, state: State) -> Gaussian:
    """Return an estimate that nobody can write into, as its arrays may be those of the state.

    FloatingPointError if it is nan, or not of all tracks; of runs in lock-step, each may diverge for itself.
    """
    mean, cov, alive = estimate.mean[...], estimate.cov[...], state.existence
    sums = np.vdot(mean, mean) + np.vdot(cov, cov) + np.vdot(alive, alive)
    if mean.ndim == 2 and (math.isnan(sums) or len(mean) != len(state.ids)):
        raise FloatingPointError(f"a track's estimate or existence is {NO_ONE}")
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
    identity: Identity = fields.part("how far codes by which returns name their objects are believed", default=Identity())
    registration: Registration = fields.part("offsets of sensors that all tracks share", default=Registration())
    _plan: Plan = field(init=False, repr=False, eq=False)

    @_plan.default
    def _planned(self) -> Plan:
        parts = self.estimator, self.sensors, self.associator, self.lifecycle, self.birth, self.gate, self.identity
        return explained(self, lambda: planned(*parts, self.registration))

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
    def starters(self) -> frozenset[str]:
        """The sensors whose returns may start tracks; none: the tracks given before the first scan are all."""
        return self._plan.starters

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
        rng = source.generator(0) if self._plan.draws else NO_DRAWS
        n = len(self.state)
        prior = self.given(Recording(())) if given is None else checked_prior(given, n)
        confirmed = prior is not None
        if prior is None:
            prior = Newborn.none(n).prior
        shape, offsets = prior.mean.shape[:-1], None
        if (common := self._plan.offsets) is not None:
            offsets = Gaussian(
                *(np.broadcast_to(part, (*shape[:-1], *part.shape)) for part in (common.prior.mean, common.prior.cov))
            )
            prior = common.given(prior, common.prior)
        try:
            belief, memory = self.estimator.start(prior, self.state, rng), self.lifecycle.start(np.ones(shape[-1]))
            leaves = None
            if isinstance(self.associator, HypothesisAssociator):
                leaves = initial_leaves(self.associator, belief, memory, shape)
            unseen = self.birth.initial_memory(self.estimator, rng) if self.birth and self._plan.models_unseen else None
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
            offsets=offsets,
            linked=None if common is None else common.codes(np.arange(shape[-1])),
        )

    def state_from(self, data: Any) -> State:
        """Return the state that `State.to_data` wrote; InputError with the place if it is none of this tracker."""
        state = state_data.read(data, self.start())
        try:
            estimate = self.estimate(state)
            if estimate.mean.shape != (*state.existence.shape, len(self.state)) or len(state.ids) != estimate.mean.shape[-2]:
                raise ValueError(f"{estimate.mean.shape} estimates of {len(state.ids)} tracks")
        except (ValueError, TypeError, AttributeError, IndexError, PluginError) as error:
            raise InputError(f"state: does not fit this tracker: {error}") from None
        return state

    def step(self, state: State, scan: Scan) -> State:
        """Return the state after one scan; ScanRefused, with the state as it was, if the scan cannot be taken."""
        plan = self._plan
        try:
            observed = admitted(scan, plan.gates, state.time)
        except AttributeError:
            check_state(state)
            raise
        try:
            if plan.whole and (after := in_one_call(plan, state, scan, observed)) is not None:
                return after
            expected = expect(plan, state, scan, observed)
            met = meet(expected)
            after = conclude(expected, met, associate(expected, met))
            # The distances of a track that is nan are nan, if it has any: its moments are asked for only then.
            far, alive = met[0] and met[0].distance, after.existence
            if far is None or not far.size or math.isnan(np.vdot(far, far) + np.vdot(alive, alive)):
                _shown(plan.estimator.moments(after.belief), after)
                if far is not None and far.ndim == 2 and np.isnan(far).any():
                    raise FloatingPointError(f"a return's distance from a track is {NO_ONE}")
            return after
        except Exception as error:
            check_given(state, self.start, observed)
            explain(error, self, partial(self.step, state, scan), partial(self._from_start, state, scan))
            raise

    def _from_start(self, state: State, scan: Scan) -> None:
        """Step from a start: what `update` gives is looked at in the next step only, and may be nan in `state` already."""
        first = self.start()
        if state.existence.ndim == 1:
            self.step(self.step(first, scan), scan)

    def expect(self, state: State, scan: Scan) -> Expected:
        """Return what the tracker expects of a scan, as `step` goes on from it; nothing is associated.

        Parameters
        ----------
        state
            The state before the scan, as `start` and `step` return it.
        scan
            The scan: its time in s, sensor and pose say what is expected, its returns are those that may be judged by it.

        Raises
        ------
        ScanRefused
            If `step` would refuse the scan.
        """
        check_state(state)
        observed = admitted(scan, self._plan.gates, state.time)
        return explained(self, partial(expect, self._plan, state, scan, observed))

    def predict(self, state: State, time: float) -> Any:
        """Return the belief at `time` in s, as `step` predicts it for a scan of that time."""
        check_predicted(state, time)
        dt = time - state.time if state.time != -np.inf else 0.0
        rng = state.seed.generator(state.steps) if self._plan.draws else NO_DRAWS
        return explained(self, lambda: predicted(self.estimator, state.belief, dt, rng))

    def estimate(self, state: State, time: float | None = None) -> Gaussian:
        """Return mean (*b, t, n) and covariance (*b, t, n, n) of every track over `self.state`: at `time` in s, or now."""
        check_state(state)
        belief = state.belief if time is None else self.predict(state, time_from(state, time))
        return explained(self, lambda: _shown(self.estimator.moments(belief), state))
