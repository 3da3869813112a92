"""What differs for a tracker that keeps hypotheses: its rows are leaves of tracks, which branch, merge and are shown.

Which tracks hang together by the returns that they share, `vedette.hypotheses` knows.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette import kernels
from vedette.hypotheses import LOST, ROUNDING, Branching, HypothesisAssociator, LeafScores, firsts
from vedette.space import Array, Indices, Mask
from vedette.tracking import births, pytrees
from vedette.tracking.expected import Expected
from vedette.tracking.leaves import NONE_ENDED, Ended, Leaves, linked
from vedette.tracking.meeting import Meeting
from vedette.tracking.rows import TrackRows, judged
from vedette.types import Mixtures, Newborn

MOST_RETURNS = 2**32
"""More than a scan has returns."""


@frozen(eq=False)
class Branched:
    """How leaves branch: the associator's `branching`; of those that continue others, parent and choice (l,).

    newborn: the tracks that begin where no other takes the return; claims (k,): the probability that some other does.
    gated (l, w): the returns in the gates of the leaves before the scan, -1 for none; None where all met all.
    approximated: number of tracks of whose clusters truncation dropped more than `LOST`, and lost: what of each, in sum; or
    of tracks whose weights are inexact otherwise.
    """

    branching: Branching
    parent: Indices
    choice: Indices
    newborn: Newborn
    claims: Array
    gated: Indices | None
    approximated: int
    lost: float


def branched(it: Expected, scores: LeafScores, meetings: Sequence[Meeting] | None) -> Branched:
    """Return how the leaves branch, by their log scores; `meetings`: they met few returns each, in these meetings."""
    associator, k = hypothesis_associator(it), scores.k
    inside = np.zeros(k, dtype=bool)
    inside[scores.returns] = True
    newborn = births.newborn(it, np.zeros(k), inside)
    begins = np.zeros(k, dtype=bool)
    begins[newborn.returns] = True
    if not meetings or (close := meetings[0].close) is None:
        branching = associator.branch(it.state.leaves.hypotheses, scores, begins)
    else:
        branching = associator.branch_close(it.state.leaves.hypotheses, scores, begins, close)
    continues = branching.parent >= 0
    # Two leaves that give one return claim it once.
    once = continues if branching.merged is None else continues * np.where(branching.merged > 0, 0.5, 1.0)
    claims: Any = np.bincount(branching.choice, associator.probability(branching.hypotheses) * once, 1 + k)[1:]
    parent, approximated, total = branching.parent[continues], 0, 0.0
    if branching.lost is not None and len(parent):
        ids, lost = it.state.leaves.ids[parent], branching.lost[continues]
        worst = np.maximum.reduceat(lost, np.flatnonzero(firsts(ids)))
        approximated, total = int(np.count_nonzero(worst > LOST)), float(np.sum(worst[worst > LOST]))
    if branching.inexact is not None:
        approximated = len(np.unique(it.state.leaves.ids[parent[branching.inexact[continues]]]))
    gated = None if meetings is None else _gated(scores)
    return Branched(branching, parent, branching.choice[continues], newborn, claims, gated, approximated, total)


def branch_out(it: Expected, by: Branched, rows: TrackRows, p_detect: Array) -> tuple[TrackRows, Any, Leaves, int]:
    """Return the tracks that are shown after a scan, the birth's memory, the leaves that stay, and how many tracks begin.

    rows: the leaves that continue others, updated; p_detect: P_D of the leaves before the scan.
    """
    associator, branching, rows = hypothesis_associator(it), by.branching, _with_begun(it, by, rows)
    distance, lost, sure = np.sum(rows.weights[:, 1:] * rows.distances, axis=-1), branching.lost, None
    hit = (branching.choice > 0).astype(float)
    if associator.merges == "kept":
        mix = _merged(it, branching, rows, hit)
        branching, rows, hit, own = mix.branching, mix.rows, mix.hit, mix.own
        distance, lost = distance[own], None if lost is None else lost[own]
        sure = _sure(it, branching, mix.share)

    probability = associator.probability(branching.hypotheses)
    last = _last(it, branching)
    of_target = associator.existence(branching.hypotheses, rows.existence, last)
    shown_existence = of_target if associator.shows_marginals else rows.existence
    rows, alive = _reviewed(it, rows, of_target, shown_existence, branching.parent, hit, p_detect)
    unseen, ended = births.looked(it, it.memory, by.claims), NONE_ENDED
    if not alive.all():
        unseen = births.recycled(it, unseen, rows.belief, ~alive, rows.existence * probability)
        ended = Ended(rows.ids[~alive], branching.parent[~alive], rows.existence[~alive], probability[~alive])

    hypotheses, stay = associator.keep(branching.hypotheses, alive)
    parent, choice = branching.parent[stay], branching.choice[stay]
    staying = rows if len(stay) == len(rows.ids) else pytrees.take(rows, stay, 0)
    decided = associator.probability(hypotheses) > probability[stay] * (1.0 + ROUNDING)
    if decided.any():
        after_it = associator.existence(hypotheses, staying.existence, last[stay])
        existence = _no_surer(it, decided, staying.existence, of_target[stay], after_it)
        staying, shown_existence = evolve(staying, existence=existence), np.array(shown_existence)
        shown_existence[stay] = np.minimum(shown_existence[stay], existence)
    if associator.merges == "shown":
        mix = _merged(it, Branching(parent, choice, hypotheses), staying, hit[stay])
        branching, rows, own = mix.branching, mix.rows, mix.own
        shown_existence, alive = rows.existence, np.ones(len(rows.ids), dtype=bool)
        # A target that several tracks may be is the one that holds half of it: else each would be confirmed for it.
        rows = evolve(rows, confirmed=rows.confirmed & (rows.existence >= 0.5 * of_target[stay][own]))
    shown = associator.reported(branching.hypotheses, rows.existence)
    shown = shown[alive[shown]]
    row_of = own[shown] if associator.merges == "shown" else np.searchsorted(stay, shown)
    lost = None if lost is None else lost[stay]
    there = linked(associator, associator.probability(hypotheses) * staying.existence, lost)
    after = Leaves(
        staying.belief, staying.memory, hypotheses, staying.ids, staying.existence, staying.confirmed, parent, choice,
        distance[stay], last[stay], row_of, there, ended=ended,
        lost=lost, sure=None if sure is None else sure[stay], names=staying.names,
    )  # fmt: skip
    return pytrees.take(evolve(rows, existence=shown_existence), shown, 0), unseen, after, len(by.newborn.returns)


def _with_begun(it: Expected, by: Branched, rows: TrackRows) -> TrackRows:
    """Return the leaves that continue others, then those of tracks that begin."""
    count, branching = len(by.parent), by.branching
    if count == len(branching.parent):
        return rows
    begun = np.searchsorted(by.newborn.returns, branching.choice[count:] - 1)
    begin = pytrees.take(by.newborn, begun, 0)
    free = hypothesis_associator(it).probability(branching.hypotheses)[count:]
    return births.joined(it, rows, begin, it.state.born + begun, begin.existence, begin.existence * free)


def _no_surer(it: Expected, decided: Mask, own: Array, of_target: Array, after: Array) -> Array:
    """Return the existence (l,) of leaves: that a history is decided makes no target surer than before, nor ends it."""
    surer = after / np.maximum(of_target, 1e-300)
    least = np.minimum(own, it.plan.lifecycle.least_existence)
    return np.maximum(own / np.where(decided, np.maximum(surer, 1.0), 1.0), least)


def hypothesis_associator(it: Expected) -> HypothesisAssociator:
    """Return the tracker's associator, which keeps hypotheses."""
    assert isinstance(it.plan.associator, HypothesisAssociator)
    return it.plan.associator


def _gated(scores: LeafScores) -> Indices:
    """Return the returns (l, w) in the gate of each leaf, -1 for none."""
    leaf, number = scores.leaf, np.diff(scores.ends, prepend=0)
    gated = np.full((len(number), int(np.max(number, initial=0))), -1)
    gated[leaf, kernels.counted(number)] = scores.returns
    return gated


def _last(it: Expected, branching: Branching) -> Indices:
    """Return the numbers (l, 3) of the returns that each leaf took last."""
    # What two targets gave tells neither from the other.
    last, old, hit = np.full((len(branching.parent), 3), -1), branching.parent >= 0, branching.alone
    last[old] = it.state.leaves.last[branching.parent[old]]
    last[hit, :-1], last[hit, -1] = last[hit, 1:], (it.state.steps * MOST_RETURNS + branching.choice)[hit]
    return last


@frozen(eq=False)
class MergedLeaves:
    """Leaves merged into fewer: how they branch, their rows, the probability of having been detected, the row of the leaf
    whose past each has, and the share of those that took the same return.
    """

    branching: Branching
    rows: TrackRows
    hit: Array
    own: Indices
    share: Array


def _merged(it: Expected, branching: Branching, rows: TrackRows, hit: Array) -> MergedLeaves:
    """Return the leaves merged into fewer, each with the moments of its mixture and the past of one of them."""
    plan, estimate = it.plan, it.plan.estimator.moments(rows.belief)
    merging = hypothesis_associator(it).merge(branching.hypotheses, estimate, rows.existence, plan.state)
    past, count = merging.own, len(merging.own)
    mass = merging.shares * rows.existence[merging.leaf]
    total = np.bincount(merging.into, mass, count).astype(float)
    nothing, some = np.flatnonzero(total == 0.0), mass > 0.0  # what is of no target at all is as its own leaf
    into, leaf = np.append(merging.into[some], nothing), np.append(merging.leaf[some], past[nothing])
    shares = np.append(mass[some] / total[merging.into[some]], np.ones(len(nothing)))
    belief = plan.estimator.merge(rows.belief, Mixtures(into, leaf, shares, count))
    after = evolve(pytrees.take(rows, past, 0), belief=belief, existence=np.minimum(total, 1.0))
    seen: Array = np.bincount(merging.into, merging.shares * hit[merging.leaf], count).astype(float)
    alike = branching.choice[leaf] == branching.choice[past[into]]
    share: Array = np.bincount(into, shares * alike, count).astype(float)
    both = None if branching.merged is None else branching.merged[past]
    fewer = Branching(branching.parent[past], branching.choice[past], merging.hypotheses, merged=both)
    return MergedLeaves(fewer, after, seen, past, share)


def _sure(it: Expected, branching: Branching, share: Array) -> Array:
    """Return the shares (l, 2) of the returns that merged leaves took last, and before that."""
    before, old, hit = it.state.leaves.sure, branching.parent >= 0, branching.alone
    sure = np.ones((len(branching.parent), 2))
    if before is not None:
        sure[old] = before[branching.parent[old]]
    sure[hit, 1], sure[hit, 0] = sure[hit, 0], share[hit]
    return sure


def _reviewed(
    it: Expected, rows: TrackRows, of_target: Array, shown: Array, parent: Indices, hit: Array, p_detect: Array
) -> tuple[TrackRows, Mask]:
    """Return the leaves judged by the lifecycle, and which of them go on; those that have just begun do.

    of_target (l,): the existence of each leaf's target, by which it is confirmed and ends. It also ends where it would by
    what it is shown with, `shown` (l,): its hypotheses may as well hold no target.
    """
    count = int(np.count_nonzero(parent >= 0))
    old, new = slice(count), len(rows.ids) - count
    belief, before, seen = *pytrees.take((rows.belief, rows.memory), old, 0), (hit[old], p_detect[parent[old]], shown[old])
    memory, confirmed, alive = judged(it, belief, before, of_target[old], *seen)
    if np.any(shown[old] < it.plan.lifecycle.least_existence):
        alive = alive & judged(it, belief, before, np.minimum(shown, of_target)[old], *seen)[2]
    if new > 0:
        memory = pytrees.join(memory, pytrees.take(rows.memory, slice(count, None), 0), 0)
        confirmed, alive = np.append(confirmed, np.zeros(new, dtype=bool)), np.append(alive, np.ones(new, dtype=bool))
    return evolve(rows, memory=memory, confirmed=confirmed), alive
