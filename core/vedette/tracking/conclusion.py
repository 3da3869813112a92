"""The end of a step, for all layouts: rows are updated and judged, some end, some begin, and the next state is made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import evolve

from vedette import kernels
from vedette.hypotheses import MOST_AT_ONCE
from vedette.space import Array, Indices
from vedette.tracking import births, pytrees
from vedette.tracking.association import Associated
from vedette.tracking.branching import Branched, branch_out, hypothesis_associator
from vedette.tracking.expected import Expected
from vedette.tracking.identity import after_scan
from vedette.tracking.leaves import Leaves
from vedette.tracking.lineage import Gates, new_gates
from vedette.tracking.meeting import Meeting, Met
from vedette.tracking.own_times import updated
from vedette.tracking.registration import LINKS, Offsets
from vedette.tracking.rows import TrackRows, judged, looked, new_track_rows
from vedette.tracking.state import State, next_state
from vedette.types import Detections, Gaussian

NONE: Indices = np.zeros(0, dtype=np.int64)


def conclude(it: Expected, met: Met, by: Associated) -> State:
    """Return the state after a scan."""
    plan, state, weights, (innovation, scores, meetings) = it.plan, it.state, by.weights, met
    if by.branched is not None:
        belief = _of_branches(it, met, by.branched, weights)
    elif meetings is not None and by.of_few is not None:
        belief = _of_meetings(it, meetings, by.of_few)
    else:
        if not plan.lifecycle.certain:
            weights = kernels.given_existence(weights, scores, innovation.loglik, it.existence)
        belief = updated(plan.estimator, it.belief, innovation, weights)
    offsets, linked = it.offsets, state.linked
    if plan.offsets is not None:
        belief, offsets, linked = _agreed(it, plan.offsets, by, belief)
    scan = {
        "time": it.scan.time,
        "steps": state.steps + 1,
        "approximated": state.approximated + by.approximated,
        "offsets": offsets,
        "linked": linked,
    }
    if plan.keeps_tracks:
        weights, distances, returns = _tables(by)
        names = after_scan(plan.identity, state.names, it.observed, weights, returns, by.claims)
        took = {"weights": weights, "distances": distances, "returns": returns, "names": names}
        return next_state(state, belief=belief, existence=it.existence, **took, **scan)
    rows, unseen, leaves, begun = _of_tracks(it, by, belief) if by.branched is None else _of_leaves(it, by, belief)
    return next_state(
        state, belief=rows.belief, memory=rows.memory, unseen=unseen, ids=rows.ids, existence=rows.existence,
        confirmed=rows.confirmed, weights=rows.weights, distances=rows.distances, born=state.born + begun, leaves=leaves,
        returns=rows.returns, gates=_gates(it, scores, by), names=rows.names,
        lost=state.lost + (0.0 if by.branched is None else by.branched.lost),
        looks=looked(it) if len(plan.gates) > 1 else state.looks, **scan,
    )  # fmt: skip


def _agreed(it: Expected, common: Offsets, by: Associated, belief: Any) -> tuple[Any, Gaussian, Indices]:
    """Return the belief with what other tracks learnt of the offsets, the offsets, and the ids of linked tracks."""
    before, linked = it.offsets, it.state.linked
    assert before is not None
    assert linked is not None
    rows, leaves, ids = common.of(it.plan.estimator.moments(it.belief)), None, it.state.ids
    shares, confirmed = it.existence if by.seen is None else by.seen[1], it.state.confirmed
    if by.branched is not None:
        parent, all_leaves = by.branched.parent, it.state.leaves
        leaves, confirmed = all_leaves.ids[parent], all_leaves.confirmed[parent]
        rows, ids = pytrees.take(rows, parent, 0), leaves
        shares = shares * hypothesis_associator(it).probability(by.branched.branching.hypotheses)[: len(parent)]
    took = ids[np.nonzero((1.0 - by.weights[..., 0]) * shares > LINKS)[-1]]
    linked, tell = common.tell(ids, np.union1d(linked, common.codes(took, it.scan.sensor)))
    shares = shares * confirmed * tell
    return *common.agree(it.plan.estimator, before, rows, belief, shares, leaves), linked


def _tables(by: Associated) -> tuple[Array, Array, Indices | None]:
    """Return the weights, distances and returns of all tracks, as a `State` has them."""
    return (by.weights, by.distances, by.returns) if by.taken is None else by.taken.tables(np.arange(len(by.weights)), NONE)


def _gates(it: Expected, scores: Array | None, by: Associated) -> Gates | None:
    """Return the returns in the gates of the state's tracks, or leaves; None where no track splits or merges."""
    state = it.state
    if by.branched is not None:
        after = by.branched
        return Gates(state.ids, state.confirmed, state.born, state.leaves.ids, scores, after.gated, after.newborn.returns)
    if it.plan.lifecycle.permanent or not it.gate.axes:
        return None
    rows, returns = state.ids, by.returns
    if by.taken is not None:
        rows, returns = rows[by.taken.pairs.tracks], by.taken.pairs.returns[:, None]
    return new_gates(state.ids, state.confirmed, state.born, rows, scores, returns, None)


def _of_branches(it: Expected, met: Met, by: Branched, weights: Array) -> Any:
    """Return the belief after the scan of leaves that branched."""
    # Each leaf has its return for certain: there is no existence to condition on.
    estimator, parent, (innovation, _, meetings) = it.plan.estimator, by.parent, met
    if meetings is None:
        return updated(estimator, pytrees.take(it.belief, parent, 0), pytrees.take(innovation, parent, 0), weights)
    meeting_of, place = np.zeros(len(it.existence), dtype=np.int64), np.zeros(len(it.existence), dtype=np.int64)
    for number, meeting in enumerate(meetings):
        meeting_of[meeting.rows], place[meeting.rows] = number, np.arange(len(meeting.rows))
    rows, after = [], []
    for number, meeting in enumerate(meetings):
        whole = np.flatnonzero(meeting_of[parent] == number)
        # Leaves meet the same returns as the one before: copied for all at once, they would take gigabytes.
        for leaves in np.array_split(whole, 1 + len(whole) * meeting.returns.shape[1] // MOST_AT_ONCE):
            at, taken = place[parent[leaves]], by.choice[leaves, None]
            rows.append(leaves)
            if meeting.close is not None:
                after.append(meeting.close.updated(it, meeting, at, taken, by.branching.merged, leaves))
                continue
            taking = (meeting.returns[at] == taken - 1) & (taken > 0)
            sure = np.concatenate([taken == 0, taking], axis=1)[:, None].astype(float)
            after.append(estimator.update(*pytrees.take((meeting.belief, meeting.innovation), at, 0), sure))
    return pytrees.take(pytrees.in_order(after, rows), 0, 1)


def _of_meetings(it: Expected, meetings: Sequence[Meeting], weights_of: Sequence[Array]) -> Any:
    """Return the belief after the scan of tracks that met few returns each, in their order."""
    estimator = it.plan.estimator
    after = []
    for meeting, weights in zip(meetings, weights_of, strict=True):
        if not it.plan.lifecycle.certain:
            prior = it.existence[meeting.rows, None]
            weights = kernels.given_existence(weights, meeting.scores, meeting.innovation.loglik, prior)
        after.append(estimator.update(meeting.belief, meeting.innovation, weights))
    return pytrees.take(pytrees.in_order(after, [meeting.rows for meeting in meetings]), 0, 1)


def _of_leaves(it: Expected, by: Associated, belief: Any) -> tuple[TrackRows, Any, Leaves, int]:
    """Return the tracks that are shown, the birth's memory, the leaves that stay, and how many tracks begin."""
    assert by.branched is not None
    assert by.seen is not None
    leaves, (_, existence, p_detect) = it.state.leaves, by.seen
    memory, ids, confirmed = pytrees.take((leaves.memory, leaves.ids, leaves.confirmed), by.branched.parent, 0)
    names = after_scan(
        it.plan.identity, pytrees.take(leaves.names, by.branched.parent, 0), it.observed, by.weights, by.returns, by.claims
    )
    rows = TrackRows(belief, memory, ids, existence, confirmed, by.weights, by.distances, by.returns, names)
    return branch_out(it, by.branched, rows, p_detect)


def _of_tracks(it: Expected, by: Associated, belief: Any) -> tuple[TrackRows, Any, None, int]:
    """Return the tracks that go on and those that begin, the birth's memory, no leaves, and how many begin."""
    plan, state, unseen = it.plan, it.state, it.memory
    memory, existence, confirmed, alive = state.memory, it.existence, state.confirmed, None
    if by.seen is not None:
        hit, existence, p_detect = by.seen
        memory, confirmed, alive = judged(it, belief, memory, existence, hit, p_detect)
    weights, _, returns = (by.weights, None, None) if it.observed.identity is None else _tables(by)
    names = after_scan(plan.identity, state.names, it.observed, weights, returns, by.claims)
    rows = new_track_rows(belief, memory, state.ids, existence, confirmed, by.weights, by.distances, by.returns, names)
    if alive is not None and np.count_nonzero(alive) < alive.size:
        if alive.ndim > 1:
            told = "runs in lock-step keep their tracks; use one that ends none, such as 'single_target'"
            raise ValueError(f"lifecycle: {told}")
        # What ended is recycled before the birth looks at the scan, so such targets count as missed by it once more.
        rows, unseen = pytrees.take(rows, alive, 0), births.recycled(it, unseen, belief, ~alive, existence)
    begun = NONE
    if plan.begins and isinstance(it.observed, Detections):
        unseen = births.looked(it, unseen, by.claims)
        begin = births.newborn(it, by.claims)
        begun, rows = begin.returns, births.with_newborn(it, rows, begin) if len(begin.returns) else rows
    if by.taken is not None:
        on = np.arange(len(by.weights)) if alive is None else np.flatnonzero(alive)
        weights, distances, returns = by.taken.tables(on, begun)
        rows = evolve(rows, weights=weights, distances=distances, returns=returns)
    return rows, unseen, None, len(begun)
