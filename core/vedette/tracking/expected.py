"""What a tracker expects of a scan: the first part of a step, and what reports, tuning and explanations judge returns by."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.filters.linear import expected_return
from vedette.filters.motion import predicted
from vedette.roles import Sensor
from vedette.sampling.seeds import NO_DRAWS
from vedette.space import Array, Mask
from vedette.tracking import pytrees
from vedette.tracking.gate import SensorGate
from vedette.tracking.identity import Names
from vedette.tracking.own_times import evaluated, moments_of
from vedette.tracking.plan import Plan
from vedette.tracking.state import State
from vedette.types import Detections, Frame, Gaussian, Innovation, Scan
from vedette.values import maker

NEVER = -math.inf
"""The time of a state before the first scan, whenever that is."""


@frozen(eq=False)
class Undetected:
    """Targets without a track at the scan, as the birth models them.

    memory: the birth's; rate (k,): the density of returns from them at each return, None of a frame; sources: what the
    birth begins tracks with, of each time at which there are returns if these have times of their own.
    """

    memory: Any
    rate: Array | None
    sources: Any


@frozen(eq=False)
class Expected:
    """What a tracker in a `state` expects of a `scan`, before it knows whose its returns are.

    sensor    the scan's, placed where it stood;  gate  its constants, the threshold of the squared distance among them
    observed  the scan's returns or frame, checked
    dt        time since the state, in s
    belief    predicted by dt, as the estimator keeps it, and existence: of tracks (*b, t), or of their leaves where the
              associator keeps hypotheses
    undetected  targets without a track, None where the birth models none
    offsets   what all tracks share, predicted by dt; None if they share nothing
    """

    plan: Plan
    state: State
    scan: Scan
    observed: Detections | Frame
    sensor: Sensor
    gate: SensorGate
    dt: float
    belief: Any
    existence: Array
    undetected: Undetected | None
    rng: np.random.Generator
    offsets: Gaussian | None

    @property
    def names(self) -> Names | None:
        """The codes that tracks, or their leaves, bear; None where no return named its object."""
        return self.state.rows.names

    @property
    def rate(self) -> Array | None:
        """The density (k,) of returns from undetected targets at each return; None: not stated."""
        return None if self.undetected is None else self.undetected.rate

    @property
    def memory(self) -> Any:
        """The birth's memory at the scan; None where it models no undetected targets."""
        return None if self.undetected is None else self.undetected.memory

    @property
    def tracks(self) -> Gaussian:
        """Mean (*b, t, n) and covariance (*b, t, n, n) of the state's tracks at the time of the scan."""
        if self.state.leaves is None:
            return self.plan.estimator.moments(self.belief)
        rng = self.state.seed.generator(self.state.steps) if self.plan.draws else NO_DRAWS
        return self.plan.estimator.moments(predicted(self.plan.estimator, self.state.belief, self.dt, rng))

    @property
    def confirmed(self) -> Mask:
        """Whether each track, or leaf, was confirmed before the scan."""
        return self.state.rows.confirmed

    @property
    def reach(self) -> Any:
        """The squared distance beyond which no return counts: of all tracks, or leaves, or of each (t, 1)."""
        plan, gate, seen = self.plan, self.gate, self.observed
        if not gate.beyond or isinstance(seen, Frame):
            return gate.threshold
        if seen.missing is not None:
            return math.inf
        x = plan.estimator.moments(self.belief).mean[..., plan.state.locate(self.sensor.observes)]
        far = plan.gate.reach(gate, self.sensor, seen, x, self.existence)
        return np.maximum(np.where(self.confirmed, far, 0.0), gate.threshold)[:, None]

    @property
    def innovation(self) -> Innovation:
        """How each track, or leaf, compares with each return; `distance` (*b, t, k) beyond `gate.threshold` is outside."""
        plan, observed = self.plan, self.observed
        if isinstance(observed, Frame) or observed.time is None:
            return plan.estimator.evaluate(self.belief, self.sensor, observed, plan.p_gate)
        beliefs, limit = (self.state.rows.belief, self.belief), self.reach
        return evaluated(plan.estimator, self.sensor, beliefs, self.scan, observed, self.dt, plan.p_gate, limit, self.rng)

    def at(self, i: int) -> Expected:
        """Return what is expected at the time of return `i`; where returns have no times of their own, this."""
        if self.scan.detections.time is None:
            return self
        time = max(float(self.scan.detections.time[i]), self.scan.time - self.dt)
        dt = self.dt - (self.scan.time - time)
        belief = predicted(self.plan.estimator, self.state.rows.belief, dt, self.rng)
        return evolve(self, scan=evolve(self.scan, time=time), dt=dt, belief=belief)

    def returns_of(self, tracks: Gaussian, noise: Array | None = None) -> tuple[Array, Array, Array]:
        """Return what the sensor is expected to measure of some tracks (*b, t, n).

        Parameters
        ----------
        tracks
            Mean and covariance at the time of the scan, some or all of `tracks`.
        noise
            The covariance R of a return that states its own (m, m) or (*b, t, m, m); None: the sensor's.

        Returns
        -------
        The measurement (*b, t, m), the covariance S = H P H' + R of the innovation, and H over the sensor's axes.
        """
        return expected_return(tracks, self.plan.state, self.sensor, noise)


new_expected = maker(Expected)


def expect(plan: Plan, state: State, scan: Scan, observed: Detections | Frame) -> Expected:
    """Return what is expected of a scan, with `observed` its returns or frame as they were admitted."""
    gate, estimator = plan.gates[scan.sensor], plan.estimator
    sensor = gate.sensor.placed(scan.pose)
    dt = scan.time - (state.time if state.time != NEVER else _earliest(scan, observed))

    rng = state.seed.generator(state.steps) if plan.draws else NO_DRAWS
    rows = state.rows
    belief, existence = predicted(estimator, rows.belief, dt, rng), rows.existence
    if not plan.lifecycle.certain:
        existence = plan.lifecycle.predict(existence, dt)
        if isinstance(observed, Frame):
            belief = estimator.informed(belief, existence)
    undetected = _undetected(plan, state, scan, dt, sensor, observed, rng) if plan.models_unseen else None
    offsets = state.offsets
    if plan.offsets is not None and offsets is not None:
        offsets = plan.offsets.ahead(estimator, offsets, dt)
    return new_expected(plan, state, scan, observed, sensor, gate, dt, belief, existence, undetected, rng, offsets)


def _earliest(scan: Scan, observed: Detections | Frame) -> float:
    """Return the time of the first scan's first return: tracks that are given without a time are of then."""
    return scan.time if observed.time is None else float(np.min(observed.time, initial=scan.time))


def _undetected(
    plan: Plan, state: State, scan: Scan, dt: float, sensor: Sensor, observed: Detections | Frame, rng: np.random.Generator
) -> Undetected:
    """Return what the birth models of targets without a track, at the scan and at the times of its returns."""
    birth, estimator = plan.birth, plan.estimator
    assert birth is not None
    memory = birth.predict(state.unseen, estimator, dt, rng)
    if isinstance(observed, Frame):
        return Undetected(memory, None, None)
    if observed.time is None:
        return Undetected(memory, *birth.reveal(memory, estimator, sensor, observed, plan.p_gate))
    rate, sources, stated = np.zeros(len(observed.z)), [], True
    for ahead, _, some in moments_of(scan, observed, dt):
        then = birth.predict(state.unseen, estimator, ahead, rng)
        density, source = birth.reveal(then, estimator, sensor, pytrees.take(observed, some, 0), plan.p_gate)
        rate[some], stated = 0.0 if density is None else density, density is not None
        sources.append(source)
    return Undetected(memory, rate if stated else None, sources)
