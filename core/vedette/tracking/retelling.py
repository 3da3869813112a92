"""What later scans say of earlier ones where hypotheses are kept: which tracks there were, and which returns they took.

The hypothesis that is best after the last scan has one past. Tracks are smoothed along it, so their associations are those
of all scans, too. docs/smoothing.md says what is exact.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.hypotheses import HypothesisAssociator
from vedette.roles import Estimator
from vedette.sampling.seeds import NO_DRAWS, Seed, Seeds
from vedette.space import Array, Indices, Mask
from vedette.tracking import pytrees
from vedette.tracking.leaves import Leaves, linked
from vedette.tracking.state import State, next_state
from vedette.tracking.tracker import Tracker


@frozen(eq=False)
class Told:
    """What all scans say of one: the `rows` (t,) of the leaves that are shown, their belief, existence and confirmation.

    mass (l,): the probability of each leaf of the scan, given all scans; there (l,): that it is right and its target exists.
    """

    rows: Indices
    belief: Any
    existence: Array
    confirmed: Mask
    mass: Array
    there: Array


def retold(tracker: Tracker, associator: HypothesisAssociator, states: Sequence[State], seed: Seed | Seeds) -> list[State]:
    """Return every state as all of them tell it: tracks and their returns in the hypothesis that is best in the end.

    A track that ended on the way is there if the likeliest hypothesis of its time that leads to the best one holds it.
    """
    last = states[-1]
    leaves: Leaves = last.leaves
    mass = associator.probability(leaves.hypotheses)
    there = mass * leaves.existence
    told = Told(leaves.shown, last.belief, last.existence, last.confirmed, mass, there)
    if associator.merges == "shown":  # means over hypotheses have no past: it is that of the heaviest one
        rows = associator.shown_with(leaves.hypotheses, leaves.existence, np.zeros(0, dtype=np.int64))
        belief, existence, confirmed = pytrees.take((leaves.belief, leaves.existence, leaves.confirmed), rows, 0)
        told = Told(rows, belief, existence, confirmed, mass, there)
    left = dict[int, float]()  # of each track, the probability that it goes on after the last scan
    for number, of in zip(leaves.ids.tolist(), mass.tolist(), strict=True):
        left[number] = left.get(number, 0.0) + of
    states_told = [last]
    for state, later in zip(states[-2::-1], states[:0:-1], strict=True):
        rng = seed.generator(state.steps) if tracker.estimator.traits.draws else NO_DRAWS
        told = _before(tracker, associator, state, later, told, left, rng)
        states_told.append(_shown(associator, state, told))
    return states_told[::-1]


def _before(
    tracker: Tracker, associator: HypothesisAssociator, state: State, later: State, after: Told, left: dict[int, float],
    rng: np.random.Generator,
) -> Told:  # fmt: skip
    """Return what all scans say of a state, from what they say of the `later` one."""
    leaves, dt = state.leaves, later.time - state.time
    # A target that does not exist later may have existed before: e (1 - p) / (1 - e p), with probability p of surviving.
    survives = tracker.lifecycle.predict(np.ones(len(leaves.ids)), dt)
    gone = 1.0 - leaves.existence * survives
    left_before = np.divide(leaves.existence * (1.0 - survives), gone, out=np.zeros_like(gone), where=gone > 0)
    mass, there = _masses(associator, leaves, later.leaves, after, left, left_before)

    parent = later.leaves.parent[after.rows]
    old = parent >= 0
    took, parent = leaves.choice[parent[old]], parent[old]
    others = associator.shown_with(leaves.hypotheses, leaves.existence, parent)
    others = others[~np.isin(leaves.ids[others], leaves.ids[parent]) & ~np.isin(leaves.choice[others], took[took > 0])]
    rows = np.sort(np.concatenate([parent, others]))  # as tracks do in all states
    goes_on = np.isin(rows, parent)

    later_belief = pytrees.take(after.belief, old, 0)
    belief = smoothed_rows(tracker.estimator, pytrees.take(leaves.belief, rows, 0), goes_on, later_belief, dt, rng)
    confirmed = np.array(leaves.confirmed[rows])
    confirmed[goes_on] |= after.confirmed[old]
    if associator.shows_marginals:
        existence: Array = np.bincount(leaves.ids - leaves.ids[:1], there).astype(float)[leaves.ids[rows] - leaves.ids[:1]]
    else:
        ended = later.leaves.ended
        stops = np.bincount(ended.parent, ended.probability, len(leaves.ids))[rows]
        at_end = np.bincount(ended.parent, ended.probability * ended.existence, len(leaves.ids))[rows]
        at_end = np.divide(at_end, stops, out=np.zeros(len(rows)), where=stops > 0)
        at_end[goes_on] = after.existence[old]
        existence = at_end + (1.0 - at_end) * left_before[rows]
        existence = np.where(goes_on | (stops > 0), existence, leaves.existence[rows])
    return Told(rows, belief, np.minimum(existence, 1.0), confirmed, mass, there)


def smoothed_rows(
    estimator: Estimator[Any], belief: Any, goes_on: Mask, later: Any, dt: float, rng: np.random.Generator, axis: int = 0
) -> Any:
    """Return a belief whose rows that go on are smoothed by theirs `dt` s later."""
    if goes_on.all() or not goes_on.any():
        return estimator.smooth_step(belief, later, dt, rng) if goes_on.any() else belief
    back = estimator.smooth_step(pytrees.take(belief, goes_on, axis), later, dt, rng)
    rows = np.flatnonzero(goes_on), np.flatnonzero(~goes_on)
    return pytrees.in_order([back, pytrees.take(belief, ~goes_on, axis)], rows, axis)


def _masses(
    associator: HypothesisAssociator, leaves: Leaves, later: Leaves, after: Told, left: dict[int, float], left_before: Array
) -> tuple[Array, Array]:
    """Return the probability (l,) of each leaf given all scans, and that its target exists then, too.

    Of leaves that ended nothing more was heard: all hypotheses in which a track has ended become likelier alike. Of what
    truncation dropped nothing more is known than before it: with its probability the leaf is as likely as then.
    """
    count, old = len(left_before), later.parent >= 0
    parent, mass, there = later.parent[old], after.mass[old], after.there[old]
    ended = later.ended
    if len(ended.parent):
        ids, which = np.unique(np.concatenate([later.ids, ended.ids]), return_inverse=True)
        goes_on = np.bincount(which[: len(later.ids)], associator.probability(later.hypotheses), len(ids))
        stops = np.bincount(which[len(later.ids) :], ended.probability, len(ids))
        at_end = np.array([left.get(number, 0.0) for number in ids.tolist()])
        room = np.maximum(1.0 - goes_on, stops)
        scale = np.divide(1.0 - at_end, room, out=np.zeros(len(ids)), where=room > 0)
        likely = ended.probability * np.maximum(scale, 0.0)[which[len(later.ids) :]]
        parent, mass = np.append(parent, ended.parent), np.append(mass, likely)
        there = np.append(there, likely * ended.existence)
    before: Array = np.bincount(parent, mass, count).astype(float)
    exists: Array = np.bincount(parent, there + (mass - there) * left_before[parent], count).astype(float)
    if later.lost is None:
        return before, exists
    numbers = np.unique(np.concatenate([leaves.ids, later.ids]))
    lost = np.zeros(len(numbers))
    np.maximum.at(lost, np.searchsorted(numbers, later.ids), later.lost)
    dropped, held = lost[np.searchsorted(numbers, leaves.ids)], associator.probability(leaves.hypotheses)
    return before + dropped * (held - before), exists + dropped * (held * leaves.existence - exists)


def _shown(associator: HypothesisAssociator, state: State, told: Told) -> State:
    """Return a state with the tracks that are told, and the returns that they took."""
    leaves: Leaves = state.leaves
    rows = told.rows
    choice = leaves.choice[rows]
    hit = (choice > 0).astype(float)
    return next_state(
        state,
        belief=told.belief,
        memory=pytrees.take(leaves.memory, rows, 0),
        ids=leaves.ids[rows],
        existence=told.existence,
        confirmed=told.confirmed,
        weights=np.stack([1.0 - hit, hit], axis=-1),
        distances=leaves.distance[rows, None],
        returns=choice[:, None] - 1,
        gates=None,
        names=pytrees.take(leaves.names, rows, 0),
        leaves=evolve(leaves, shown=rows, there=linked(associator, told.there, leaves.lost)),
    )
