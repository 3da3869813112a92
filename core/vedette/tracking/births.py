"""How tracks begin: the birth is asked, and its tracks are joined to the existing ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any, Protocol

import numpy as np
from attrs import evolve

from vedette.roles import Associator, Estimator, Sensor
from vedette.space import Array, Indices, Mask, Space
from vedette.supporting import Birth, Lifecycle
from vedette.tracking import trees
from vedette.tracking.ceiling import LEAST_PAIRS, LEAST_STARTED, check_births, check_started
from vedette.tracking.gate import Gate
from vedette.tracking.state import State, compact, kept
from vedette.types import Detections, Frame, Newborn


class Parts(Protocol):
    """The parts of a tracker that begin tracks."""

    @property
    def birth(self) -> Birth | None: ...

    @property
    def estimator(self) -> Estimator[Any]: ...

    @property
    def associator(self) -> Associator: ...

    @property
    def lifecycle(self) -> Lifecycle: ...

    @property
    def gate(self) -> Gate: ...

    @property
    def state(self) -> Space: ...

    @property
    def starters(self) -> frozenset[str]: ...


def check_existence(birth: Birth | None, lifecycle: Lifecycle) -> None:
    """Raise ValueError if tracks begin with less existence than the lifecycle ends them with."""
    first = None if birth is None or lifecycle.certain else birth.initial_existence
    if first is not None and first < lifecycle.least_existence:
        least = lifecycle.least_existence
        raise ValueError(f"birth: must begin tracks with an existence of at least {least:g}, where they end, got {first:g}")


def starters(birth: Birth | None, sensors: Mapping[str, Sensor], estimator: Estimator[Any]) -> Iterator[str]:
    """Yield the sensors whose returns may start tracks; ValueError, before any run, if one cannot."""
    for name, sensor in sensors.items():
        if birth is None or not birth.starts_from(name):
            continue
        nothing = Detections.of([], len(sensor.measurement))
        try:
            birth.begin(None, estimator, sensor, name, nothing, np.zeros(0))
        except NotImplementedError as error:
            if not str(error):
                raise
            raise ValueError(f"birth.sensors: must not hold {name!r}: {error}") from None
        except ValueError as error:
            if type(error) is not ValueError or ": " not in str(error):
                raise  # numpy's, say: not the birth's own word on what it cannot start tracks from
            raise ValueError(f"birth.{error}") from None
        yield name


def reveal(
    tracker: Parts, state: State, dt: float, sensor: Sensor, observed: Detections | Frame, rng: np.random.Generator
) -> tuple[Any, Array | None, Any]:
    """Return the birth's memory at the scan, the rate of each return (k,), and what it found to begin tracks with."""
    birth, estimator, p_gate = tracker.birth, tracker.estimator, tracker.gate.probability
    assert birth is not None
    unseen = birth.predict(state.unseen, estimator, dt, rng)
    if isinstance(observed, Frame):
        return unseen, None, None
    rate, found = birth.reveal(unseen, estimator, sensor, observed, p_gate)
    return unseen, rate, found


def begin(
    tracker: Parts,
    state: State,
    found: Any,
    sensor: Sensor,
    name: str,
    observed: Detections | Frame,
    weights: Array,
    rng: np.random.Generator,
) -> State:
    """Return the state with the tracks that begin at a scan's returns, which come last; a frame begins none.

    `weights` (t, 1+k) are those of all tracks that met the scan, some of which may have ended with it.
    """
    birth = tracker.birth
    if birth is None or isinstance(observed, Frame):
        return state
    claims = claimed(weights[..., 1:], tracker.associator.exclusive)
    return begin_unclaimed(tracker, state, found, sensor, name, observed, claims, rng)


def begin_unclaimed(
    tracker: Parts,
    state: State,
    found: Any,
    sensor: Sensor,
    name: str,
    observed: Detections,
    claims: Array,
    rng: np.random.Generator,
) -> State:
    """Return the state with the tracks that begin, by the probability (k,) that a return is from an existing track."""
    birth, estimator = tracker.birth, tracker.estimator
    assert birth is not None
    if birth.models_unseen:
        unseen = birth.update(state.unseen, estimator, sensor, observed, claims, tracker.gate.probability)
        state = evolve(state, unseen=unseen)
    if name not in tracker.starters:
        return state
    newborn = birth.begin(found, estimator, sensor, name, observed, claims)
    return _joined(tracker, state, newborn, rng) if len(newborn.returns) else state


def ended(tracker: Parts, state: State, alive: Mask) -> State:
    """Return the state without the tracks that ended; a birth that models unseen targets takes them back."""
    birth, after = tracker.birth, kept(state, alive)
    if birth is None or not birth.models_unseen:
        return after
    estimate = tracker.estimator.moments(trees.take(state.belief, ~alive, 0))
    return evolve(after, unseen=birth.recycle(state.unseen, tracker.estimator, estimate, state.existence[~alive]))


def claimed(weights: Array, exclusive: bool) -> Array:
    """Return the probability (k,) that a return is some track's, from the tracks' weights (t, k).

    If no two tracks share a return, the events exclude each other and add; else they are taken as independent.
    """
    some: Array = np.minimum(np.sum(weights, axis=-2), 1.0) if exclusive else 1.0 - np.prod(1.0 - weights, axis=-2)
    return some


def claimed_by_pairs(returns: Indices, weights: Array, k: int, exclusive: bool) -> Array:
    """Return the same (k,) from the returns (p,) of pairs and their weights (p,)."""
    if exclusive:
        return np.minimum(np.bincount(returns, weights, minlength=k), 1.0)
    free = np.ones(k)
    np.multiply.at(free, returns, 1.0 - weights)
    return 1.0 - free


def _joined(tracker: Parts, state: State, newborn: Newborn, rng: np.random.Generator) -> State:
    count = len(newborn.returns)
    if state.returns is None and (len(state.ids) + count) * state.distances.shape[-1] >= LEAST_PAIRS:
        state = compact(state)
    k = state.distances.shape[-1]
    check_births(state, count, k)
    if count >= LEAST_STARTED:  # one is started by a copy of the generator, which stays as it is
        one = tracker.estimator.start(trees.take(newborn.prior, slice(1), 0), tracker.state, deepcopy(rng))
        check_started(one, len(tracker.state), count)
    existence = np.ones(count) if tracker.lifecycle.certain else newborn.existence
    belief = tracker.estimator.start(newborn.prior, tracker.state, rng)
    weights, returns = np.zeros((count, 1 + k)), state.returns
    weights[range(count), 1 + newborn.returns if returns is None else 1] = 1.0
    if returns is not None:
        own = np.full((count, k), -1)
        own[:, 0] = newborn.returns
        returns = np.concatenate([returns, own])
    return evolve(
        state,
        belief=trees.join(state.belief, belief, 0),
        memory=trees.join(state.memory, tracker.lifecycle.start(existence), 0),
        ids=np.concatenate([state.ids, state.born + np.arange(count)]),
        existence=np.concatenate([state.existence, existence]),
        confirmed=np.concatenate([state.confirmed, np.zeros(count, dtype=bool)]),
        weights=np.concatenate([state.weights, weights]),
        distances=np.concatenate([state.distances, np.zeros((count, k))]),
        born=state.born + count,
        returns=returns,
    )
