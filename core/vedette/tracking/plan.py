"""What a tracker looks up once: its parts, checked, and what of them is the same for every scan."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from attrs import frozen

from vedette.filters.declared import has_current_scan_step
from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Associator, Estimator, Sensor
from vedette.sampling.seeds import NO_DRAWS
from vedette.space import Space
from vedette.supporting import Birth, ImagingSensor, Lifecycle
from vedette.tracking.gate import Gate, SensorGate
from vedette.tracking.identity import Identity
from vedette.tracking.registration import Offsets, Registration, shared
from vedette.tracking.validation import check_forwarding, check_sensors
from vedette.types import Detections, Mixtures, Newborn

PLANE = Space.of(x="m", y="m")
_MERGE = "'kalman', 'ekf' and an 'imm' of them"


@frozen(eq=False)
class Plan:
    """A tracker's parts, the gate of each sensor, the sensors whose returns may start tracks, and the parts' traits.

    keeps_hypotheses: rows are leaves of tracks, and `associator` is a `HypothesisAssociator`; by_pairs: of many tracks and
    returns, only pairs within gates are worked on; begins: the birth takes part in scans; models_unseen: and has a memory;
    whole: of one track a run, a scan may be the estimator's one call;
    decides: the associator does, and tracks' existence is in doubt; keeps_tracks: the tracks after a scan are those before;
    offsets: the axes that all tracks share, None if there are none; coarse: the sensors whose merged returns are weighed.
    """

    estimator: Estimator[Any]
    associator: Associator
    birth: Birth | None
    lifecycle: Lifecycle
    gate: Gate
    identity: Identity
    state: Space
    gates: Mapping[str, SensorGate]
    starters: frozenset[str]
    p_gate: float
    draws: bool
    by_pairs: bool
    keeps_hypotheses: bool
    decides: bool
    keeps_tracks: bool
    whole: bool
    begins: bool
    models_unseen: bool
    offsets: Offsets | None
    coarse: frozenset[str]


def planned(
    estimator: Estimator[Any],
    sensors: Mapping[str, Sensor],
    associator: Associator,
    lifecycle: Lifecycle,
    birth: Birth | None,
    gate: Gate,
    identity: Identity,
    registration: Registration,
) -> Plan:
    """Return the plan of these parts; ValueError, with its place, if they do not go together."""
    check_forwarding(estimator)
    check_sensors(sensors, estimator, gate)
    _check_existence(birth, lifecycle)
    check_places(lifecycle, estimator.state)
    starting = frozenset(_starters(birth, sensors, estimator))
    keeps_hypotheses = isinstance(associator, HypothesisAssociator)
    if isinstance(associator, HypothesisAssociator):
        _check_hypotheses(associator, estimator, lifecycle, sensors)
    draws = estimator.traits.draws or (birth is not None and birth.draws)
    models_unseen = birth is not None and birth.models_unseen
    if birth is not None and models_unseen:
        with _own_words():
            birth.initial_memory(estimator, np.random.default_rng(0) if draws else NO_DRAWS)
    begins = bool(starting) or models_unseen
    gates = {name: gate.for_sensor(sensor, begins) for name, sensor in sensors.items()}
    keeps_tracks = lifecycle.permanent and not begins and not keeps_hypotheses
    offsets = shared(registration, estimator, sensors, birth)
    in_one = has_current_scan_step(type(estimator)) and not (draws or estimator.traits.reframes or offsets is not None)
    in_one = in_one and bool(associator.solves) and not associator.approximates
    return Plan(
        estimator=estimator,
        associator=associator,
        birth=birth,
        lifecycle=lifecycle,
        gate=gate,
        identity=identity,
        state=estimator.state,
        gates=gates,
        starters=starting,
        p_gate=gate.probability,
        draws=draws,
        by_pairs=estimator.traits.bounded and associator.by_cluster,
        keeps_hypotheses=keeps_hypotheses,
        decides=associator.decides and not lifecycle.certain,
        keeps_tracks=keeps_tracks,
        whole=keeps_tracks and lifecycle.certain and in_one,
        begins=begins,
        models_unseen=models_unseen,
        offsets=offsets,
        coarse=frozenset(_coarse(sensors, associator, gate)),
    )


def untimed(plan: Plan) -> str:
    """Return why returns with times of their own are not taken, or ""."""
    if plan.offsets is not None or plan.coarse:
        return "tracks share offsets" if plan.offsets is not None else "sensors merge returns"
    return "" if _merges(plan.estimator) else f"{plan.estimator.kind!r} merges no beliefs, as {_MERGE} do"


def _coarse(sensors: Mapping[str, Sensor], associator: Associator, gate: Gate) -> Iterator[str]:
    """Yield the sensors by which two targets may give one return; ValueError if the associator takes none."""
    for name, sensor in sensors.items():
        if sensor.unresolved(np.zeros((1, len(sensor.observes)))) is not None:
            if not associator.takes_merged:
                told = f"as 'jpda' does, for {name!r} merges them; {associator.kind!r} does not"
                raise ValueError(f"associator: must take merged returns, {told}")
            if gate.clutter != "sensor":
                raise ValueError(f"gate.clutter: must be 'sensor', as {name!r} merges returns, got {gate.clutter!r}")
            yield name


def _check_existence(birth: Birth | None, lifecycle: Lifecycle) -> None:
    """Raise ValueError if tracks begin with less existence than the lifecycle ends them with."""
    first = None if birth is None or lifecycle.certain else birth.initial_existence
    if first is not None and first < (least := lifecycle.least_existence):
        raise ValueError(f"birth: must begin tracks with an existence of at least {least:g}, where they end, got {first:g}")


def check_places(lifecycle: Lifecycle, state: Space) -> None:
    """Raise ValueError, with its place, if a lifecycle asks for positions that the state does not have."""
    if lifecycle.needs_place and not {*PLANE.axes} <= {*state.axes}:
        raise ValueError("lifecycle: must not ask where a track is, as the state has no x and y in m")
    if lifecycle.needs_spread and not any(axis.unit == "m" for axis in state.axes):
        units = ", ".join(f"{axis.name} [{axis.unit}]" for axis in state.axes)
        raise ValueError(f"lifecycle: must not limit the position's spread, in m, as no axis of the state is in m: {units}")


def _starters(birth: Birth | None, sensors: Mapping[str, Sensor], estimator: Estimator[Any]) -> Iterator[str]:
    """Yield the sensors whose returns may start tracks; ValueError, before any run, if one that is named cannot, or none."""
    unable, started = "", False
    for name, sensor in sensors.items():
        if birth is None or not birth.starts_from(name):
            continue
        nothing = Detections.of([], len(sensor.measurement))
        try:
            with _own_words():
                birth.begin(None, estimator, sensor, name, nothing, np.zeros(0))
        except NotImplementedError as error:
            if not str(error):
                raise
            if ": " in str(error) and hasattr(sensor, str(error).partition(": ")[0]):
                raise ValueError(f"sensors.{name}.{error}") from None
            if name in birth.sensors:
                raise ValueError(f"birth.sensors: must not hold {name!r}: {error}") from None
            unable = unable or f"birth: none of the sensors can start tracks: {name!r}: {error}"
            continue
        yield name
        started = True
    if unable and not started:
        raise ValueError(unable)


@contextmanager
def _own_words() -> Iterator[None]:
    """Put the place before what a birth says of its parameters."""
    try:
        yield
    except ValueError as error:
        if type(error) is not ValueError or ": " not in str(error):
            raise  # numpy's, say: not the birth's own word on what it cannot start tracks from
        raise ValueError(f"birth.{error}") from None


def of_no_track(estimator: Estimator[Any]) -> tuple[Any, np.random.Generator]:
    """Return the belief of no track at all, to ask what an estimator can do, and the generator to ask with."""
    rng = np.random.default_rng(0) if estimator.traits.draws else NO_DRAWS
    return estimator.start(Newborn.none(len(estimator.state)).prior, estimator.state, rng), rng


def _merges(estimator: Estimator[Any]) -> bool:
    """Return whether the estimator merges beliefs."""
    none, nothing = of_no_track(estimator)[0], np.zeros(0, dtype=np.int64)
    try:
        estimator.merge(none, Mixtures(nothing, nothing, np.zeros(0), 0))
    except NotImplementedError:
        return False
    return True


def _check_hypotheses(
    associator: HypothesisAssociator, estimator: Estimator[Any], lifecycle: Lifecycle, sensors: Mapping[str, Sensor]
) -> None:
    """Raise ValueError, with its place, if a part does not go with an associator that keeps hypotheses."""
    if lifecycle.certain and not lifecycle.permanent:
        raise ValueError(
            f"lifecycle: must keep existence probabilities, as 'existence' does, for {associator.kind!r} weighs hypotheses "
            f"by them; {lifecycle.kind!r} takes every track to exist"
        )
    if associator.merges and not _merges(estimator):
        raise ValueError(
            f"estimator: must merge beliefs, as {_MERGE} do, for {associator.kind!r} merges those of different tracks; "
            f"{estimator.kind!r} does not"
        )
    for name, sensor in sensors.items():
        if isinstance(sensor, ImagingSensor):
            raise ValueError(f"sensors.{name}: is a camera, but {associator.kind!r} takes returns only: use 'pda'")
