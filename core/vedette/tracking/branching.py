"""The part of a step that differs for a tracker that keeps hypotheses: its rows are leaves of tracks, not tracks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.filters.gaussian import has_gaussian_belief
from vedette.filters.mixing import merged
from vedette.hypotheses import Branching, HypothesisAssociator
from vedette.roles import Estimator, Sensor
from vedette.sampling.generators import NotInLockStep
from vedette.space import Array, Indices, Mask
from vedette.supporting import ImagingSensor, Lifecycle
from vedette.tracking import births, trees
from vedette.tracking.lineage import Gates
from vedette.tracking.spread import largest_deviation
from vedette.tracking.state import State, new_state
from vedette.types import Detections, Gaussian, Innovation, Newborn, Review, Scan


@frozen(eq=False)
class Leaves:
    """The leaves of all tracks after a scan, one a row; those that are reported are the tracks of the `State`.

    belief, memory and hypotheses are the estimator's, the lifecycle's and the associator's. ids (l,): the track that a leaf
    belongs to; parent (l,): its row after the scan before, -1 where it began; choice (l,): the return that it took, counted
    from 1, or 0 for a miss.
    """

    belief: Any
    memory: Any
    hypotheses: Any
    ids: Indices
    existence: Array
    confirmed: Mask
    parent: Indices
    choice: Indices


def check_parts(
    associator: HypothesisAssociator, estimator: Estimator[Any], lifecycle: Lifecycle, sensors: Mapping[str, Sensor]
) -> None:
    """Raise ValueError, with its place, if a part does not go with an associator that keeps hypotheses."""
    if lifecycle.certain and not lifecycle.permanent:
        raise ValueError(
            f"lifecycle: must keep existence probabilities, as 'existence' does, for {associator.kind!r} weighs hypotheses "
            f"by them; {lifecycle.kind!r} takes every track to exist"
        )
    if associator.merges and not has_gaussian_belief(estimator):
        raise ValueError(
            f"estimator: must have a Gaussian belief, as 'kalman' or 'ekf' has, for {associator.kind!r} merges those of "
            f"different tracks; {estimator.kind!r} has another"
        )
    for name, sensor in sensors.items():
        if isinstance(sensor, ImagingSensor):
            raise ValueError(f"sensors.{name}: is a camera, but {associator.kind!r} takes returns only: use 'pda'")


def initial_leaves(associator: HypothesisAssociator, belief: Any, memory: Any, shape: tuple[int, ...]) -> Leaves:
    """Return one leaf for each track that is there before the first scan."""
    if len(shape) > 1:
        raise NotInLockStep(f"associator: {associator.kind!r} keeps hypotheses, so runs go one by one")
    count = shape[0]
    hypotheses, sure = associator.initial_hypotheses(count), np.ones(count)
    return Leaves(
        belief, memory, hypotheses, np.arange(count), sure, sure > 0, np.full(count, -1), np.zeros(count, dtype=np.int64)
    )


@frozen(eq=False)
class Evaluated:
    """A scan evaluated: the predicted leaves and undetected targets, what the birth found, and the leaves' scores."""

    belief: Any
    existence: Array
    unseen: Any
    found: Any
    innovation: Innovation
    scores: Array


def grown(
    tracker: births.Parts,
    state: State,
    scan: Scan,
    seen: Detections,
    sensor: Sensor,
    it: Evaluated,
    dt: float,
    rng: np.random.Generator,
) -> State:
    """Return the state after a scan: leaves branch, tracks begin, leaves end, and those of the best hypothesis are shown."""
    associator, k = tracker.associator, seen.z.shape[0]
    assert isinstance(associator, HypothesisAssociator)
    newborn = _newborn(tracker, scan.sensor, seen, sensor, it.found)
    begins = np.zeros(k, dtype=bool)
    begins[newborn.returns] = True
    branching = associator.branch(state.leaves.hypotheses, it.scores, begins)
    continued = associator.probability(branching.hypotheses) * (branching.parent >= 0)
    claimed = np.bincount(branching.choice, continued, 1 + k)[1:]
    leaves = _branched(tracker, state.leaves, it, branching, newborn, state.born, rng)
    hit = (branching.choice > 0).astype(float)
    if associator.merges == "kept":
        branching, leaves, hit = _merged(tracker, branching, leaves, hit, rng)
    existence = associator.judged(branching.hypotheses, leaves.existence)
    leaves, alive = _reviewed(tracker, leaves, it.innovation, existence, hit, dt)
    unseen = _undetected(tracker, it, sensor, seen, claimed, leaves, ~alive, branching.hypotheses)

    hypotheses, rows = associator.keep(branching.hypotheses, alive)
    kept = trees.take(leaves, rows, 0)
    after = evolve(kept, hypotheses=hypotheses)
    if associator.merges == "shown":
        branching, leaves, _ = _merged(tracker, Branching(kept.parent, kept.choice, hypotheses), kept, hit[rows], rng)
        existence, alive = leaves.existence, np.ones(len(leaves.ids), dtype=bool)
    shown = associator.reported(branching.hypotheses, leaves.existence)
    shown = shown[alive[shown]]
    weights, distances = _of_the_scan(branching, it.innovation, shown, k)
    gates = Gates(state.ids, state.confirmed, state.born, state.leaves.ids, it.scores, None, newborn.returns)
    return new_state(
        scan.time, trees.take(leaves.belief, shown, 0), trees.take(leaves.memory, shown, 0), unseen, leaves.ids[shown],
        existence[shown], leaves.confirmed[shown], weights, distances, state.born + len(newborn.returns),
        state.approximated, state.seed, state.steps + 1, after, None, gates,
    )  # fmt: skip


def _newborn(tracker: births.Parts, name: str, seen: Detections, sensor: Sensor, found: Any) -> Newborn:
    """Return the tracks that begin where no track takes the return."""
    birth, n = tracker.birth, len(tracker.state)
    if birth is None or not birth.starts_from(name):
        return Newborn(np.zeros(0, dtype=np.intp), Gaussian(np.zeros((0, n)), np.zeros((0, n, n))), np.zeros(0))
    return birth.begin(found, tracker.estimator, sensor, name, seen, np.zeros(seen.z.shape[0]))


def _branched(
    tracker: births.Parts,
    leaves: Leaves,
    it: Evaluated,
    branching: Branching,
    newborn: Newborn,
    born: int,
    rng: np.random.Generator,
) -> Leaves:
    """Return the leaves after a scan, each updated by one return or a miss, then those of the tracks that begin."""
    old = branching.parent >= 0
    parent, choice = branching.parent[old], branching.choice[old]
    sure = np.zeros((len(parent), it.scores.shape[-1]))
    sure[range(len(parent)), choice] = 1.0
    belief = tracker.estimator.update(trees.take(it.belief, parent, 0), trees.take(it.innovation, parent, 0), sure)
    prior = it.existence[parent]
    missed = prior * np.exp(it.innovation.loglik[parent, 0])
    absent = 1.0 - prior + missed
    unseen = np.divide(missed, absent, out=np.zeros_like(absent), where=absent > 0)
    existence = np.where(choice > 0, 1.0, unseen)
    memory, ids, confirmed = trees.take(leaves.memory, parent, 0), leaves.ids[parent], leaves.confirmed[parent]
    grown = Leaves(belief, memory, None, ids, existence, confirmed, parent, choice)
    if old.all():
        return grown
    row = np.searchsorted(newborn.returns, branching.choice[~old] - 1)
    existence, none = newborn.existence[row], np.full(len(row), -1)
    belief = tracker.estimator.start(trees.take(newborn.prior, row, 0), tracker.state, rng)
    begun = Leaves(
        belief, tracker.lifecycle.start(existence), None, born + row, existence, none > 0, none, branching.choice[~old]
    )
    return trees.join(grown, begun, 0)


def _merged(
    tracker: births.Parts, branching: Branching, leaves: Leaves, hit: Array, rng: np.random.Generator
) -> tuple[Branching, Leaves, Array]:
    """Return the leaves merged into fewer, each with the moments of its mixture and the past of one of them."""
    associator, estimate = tracker.associator, tracker.estimator.moments(leaves.belief)
    assert isinstance(associator, HypothesisAssociator)
    merging = associator.merge(branching.hypotheses, estimate, leaves.existence, tracker.state)
    own, mass = merging.own, merging.shares * leaves.existence
    existence = np.minimum(np.sum(mass, axis=-1), 1.0)
    mass[existence == 0.0, own[existence == 0.0]] = 1.0
    shares = mass / np.sum(mass, axis=-1, keepdims=True)
    belief = tracker.estimator.start(merged(estimate, shares, tracker.state), tracker.state, rng)
    after = evolve(trees.take(leaves, own, 0), belief=belief, existence=existence)
    return Branching(branching.parent[own], branching.choice[own], merging.hypotheses), after, merging.shares @ hit


def _reviewed(
    tracker: births.Parts, leaves: Leaves, innovation: Innovation, existence: Array, hit: Array, dt: float
) -> tuple[Leaves, Mask]:
    """Return the leaves judged by the lifecycle, and which of them go on; those that have just begun do."""
    lifecycle, old = tracker.lifecycle, np.flatnonzero(leaves.parent >= 0)
    spread = None
    if lifecycle.needs_spread:
        spread = largest_deviation(trees.take(tracker.estimator.moments(leaves.belief), old, 0), tracker.state)
    p_detect = (1.0 - np.exp(innovation.loglik[leaves.parent[old], 0])) / tracker.gate.probability
    review = Review(dt, existence[old], hit[old], p_detect, spread)
    memory, confirmed, alive = lifecycle.review(trees.take(leaves.memory, old, 0), review)
    new = len(leaves.ids) - len(old)
    if new == 0:
        return evolve(leaves, memory=memory, confirmed=confirmed), alive
    memory = trees.join(memory, trees.take(leaves.memory, slice(len(old), None), 0), 0)
    confirmed, alive = np.append(confirmed, np.zeros(new, dtype=bool)), np.append(alive, np.ones(new, dtype=bool))
    return evolve(leaves, memory=memory, confirmed=confirmed), alive


def _undetected(
    tracker: births.Parts,
    it: Evaluated,
    sensor: Sensor,
    seen: Detections,
    claimed: Any,
    leaves: Leaves,
    ended: Mask,
    hypotheses: Any,
) -> Any:
    """Return the birth's memory after the scan, with what is left of the leaves that `ended`."""
    birth, estimator = tracker.birth, tracker.estimator
    if birth is None or not birth.models_unseen:
        return it.unseen
    unseen = birth.update(it.unseen, estimator, sensor, seen, claimed, tracker.gate.probability)
    if not ended.any():
        return unseen
    assert isinstance(tracker.associator, HypothesisAssociator)
    lost = leaves.existence * tracker.associator.probability(hypotheses)
    return birth.recycle(unseen, estimator, estimator.moments(trees.take(leaves.belief, ended, 0)), lost[ended])


def _of_the_scan(branching: Branching, innovation: Innovation, shown: Indices, k: int) -> tuple[Array, Array]:
    """Return the weights (t, 1+k) of the leaves that are shown, and their squared distances (t, k)."""
    weights, distances, parent = np.zeros((len(shown), 1 + k)), np.zeros((len(shown), k)), branching.parent[shown]
    weights[range(len(shown)), branching.choice[shown]] = 1.0
    distances[parent >= 0] = innovation.distance[parent[parent >= 0]]
    return weights, distances
