"""What differs for a tracker that keeps hypotheses: its rows are leaves of tracks, which branch, merge and are shown.

Everything about hypotheses is here and in the associator: where they will belong to clusters, this is the place.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.filters.mixing import merged
from vedette.hypotheses import Branching, HypothesisAssociator
from vedette.sampling.generators import NotInLockStep
from vedette.space import Array, Indices, Mask
from vedette.tracking import births, pytrees
from vedette.tracking.expected import Expected
from vedette.tracking.rows import Rows, judged
from vedette.types import Newborn


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


@frozen(eq=False)
class Branched:
    """How leaves branch: the associator's `branching`; of those that continue others, parent and choice (l,).

    newborn: the tracks that begin where no other takes the return; claims (k,): the probability that some other does.
    """

    branching: Branching
    parent: Indices
    choice: Indices
    newborn: Newborn
    claims: Array


def initial_leaves(associator: HypothesisAssociator, belief: Any, memory: Any, shape: tuple[int, ...]) -> Leaves:
    """Return one leaf for each track that is there before the first scan."""
    if len(shape) > 1:
        raise NotInLockStep(f"associator: {associator.kind!r} keeps hypotheses, so runs go one by one")
    count = shape[0]
    hypotheses, sure = associator.initial_hypotheses(count), np.ones(count)
    return Leaves(
        belief, memory, hypotheses, np.arange(count), sure, sure > 0, np.full(count, -1), np.zeros(count, dtype=np.int64)
    )


def branched(it: Expected, scores: Array) -> Branched:
    """Return how the leaves branch, by their log scores (l, 1+k)."""
    associator, k = _associator(it), scores.shape[-1] - 1
    newborn = births.newborn(it, np.zeros(k))
    begins = np.zeros(k, dtype=bool)
    begins[newborn.returns] = True
    branching = associator.branch(it.state.leaves.hypotheses, scores, begins)
    old = branching.parent >= 0
    claims: Any = np.bincount(branching.choice, associator.probability(branching.hypotheses) * old, 1 + k)[1:]
    return Branched(branching, branching.parent[old], branching.choice[old], newborn, claims)


def branch_out(it: Expected, by: Branched, rows: Rows, p_detect: Array) -> tuple[Rows, Any, Leaves, int]:
    """Return the tracks that are shown after a scan, the birth's memory, the leaves that stay, and how many tracks begin.

    rows: the leaves that continue others, updated; p_detect: P_D of the leaves before the scan.
    """
    associator, branching = _associator(it), by.branching
    if len(by.parent) < len(branching.parent):
        begun = np.searchsorted(by.newborn.returns, branching.choice[len(by.parent) :] - 1)
        begin = pytrees.take(by.newborn, begun, 0)
        rows = births.joined(it, rows, begin, it.state.born + begun, begin.existence)
    hit = (branching.choice > 0).astype(float)
    if associator.merges == "kept":
        branching, rows, hit = _merged(it, branching, rows, hit)

    shown_existence = associator.judged(branching.hypotheses, rows.existence)
    rows, alive = _reviewed(it, rows, shown_existence, branching.parent, hit, p_detect)
    unseen = births.looked(it, it.memory, by.claims)
    if not alive.all():
        mass = rows.existence * associator.probability(branching.hypotheses)
        unseen = births.recycled(it, unseen, rows.belief, ~alive, mass)

    hypotheses, stay = associator.keep(branching.hypotheses, alive)
    staying, parent, choice = pytrees.take(rows, stay, 0), branching.parent[stay], branching.choice[stay]
    after = Leaves(
        staying.belief, staying.memory, hypotheses, staying.ids, staying.existence, staying.confirmed, parent, choice
    )
    if associator.merges == "shown":
        branching, rows, _ = _merged(it, Branching(parent, choice, hypotheses), staying, hit[stay])
        shown_existence, alive = rows.existence, np.ones(len(rows.ids), dtype=bool)
    shown = associator.reported(branching.hypotheses, rows.existence)
    shown = shown[alive[shown]]
    return pytrees.take(evolve(rows, existence=shown_existence), shown, 0), unseen, after, len(by.newborn.returns)


def _associator(it: Expected) -> HypothesisAssociator:
    assert isinstance(it.plan.associator, HypothesisAssociator)
    return it.plan.associator


def _merged(it: Expected, branching: Branching, rows: Rows, hit: Array) -> tuple[Branching, Rows, Array]:
    """Return the leaves merged into fewer, each with the moments of its mixture and the past of one of them."""
    plan, estimate = it.plan, it.plan.estimator.moments(rows.belief)
    merging = _associator(it).merge(branching.hypotheses, estimate, rows.existence, plan.state)
    past, mass = merging.own, merging.shares * rows.existence
    existence = np.minimum(np.sum(mass, axis=-1), 1.0)
    mass[existence == 0.0, past[existence == 0.0]] = 1.0
    shares = mass / np.sum(mass, axis=-1, keepdims=True)
    belief = plan.estimator.start(merged(estimate, shares, plan.state), plan.state, it.rng)
    after = evolve(pytrees.take(rows, past, 0), belief=belief, existence=existence)
    return Branching(branching.parent[past], branching.choice[past], merging.hypotheses), after, merging.shares @ hit


def _reviewed(it: Expected, rows: Rows, existence: Array, parent: Indices, hit: Array, p_detect: Array) -> tuple[Rows, Mask]:
    """Return the leaves judged by the lifecycle, and which of them go on; those that have just begun do."""
    old = np.flatnonzero(parent >= 0)
    belief, memory = pytrees.take(rows.belief, old, 0), pytrees.take(rows.memory, old, 0)
    memory, confirmed, alive = judged(it.plan, belief, memory, it.dt, existence[old], hit[old], p_detect[parent[old]])
    new = len(rows.ids) - len(old)
    if new == 0:
        return evolve(rows, memory=memory, confirmed=confirmed), alive
    memory = pytrees.join(memory, pytrees.take(rows.memory, slice(len(old), None), 0), 0)
    confirmed, alive = np.append(confirmed, np.zeros(new, dtype=bool)), np.append(alive, np.ones(new, dtype=bool))
    return evolve(rows, memory=memory, confirmed=confirmed), alive
