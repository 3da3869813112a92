"""The end of a step, for all layouts: rows are updated and judged, some end, some begin, and the next state is made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vedette import kernels
from vedette.space import Array, Indices
from vedette.tracking import births, pytrees
from vedette.tracking.association import Associated
from vedette.tracking.branching import Leaves, branch_out
from vedette.tracking.expected import Expected
from vedette.tracking.lineage import Gates
from vedette.tracking.meeting import Met, Part
from vedette.tracking.rows import Rows, judged
from vedette.tracking.state import State, new_state
from vedette.types import Detections, Innovation


def conclude(it: Expected, met: Met, by: Associated) -> State:
    """Return the state after a scan."""
    plan, state, weights, (innovation, scores, parts) = it.plan, it.state, by.weights, met
    if by.branched is not None:
        belief = _of_branches(it, innovation, by.branched.parent, weights)
    elif parts is not None and by.parts is not None:
        belief = _of_parts(it, parts, by.parts)
    else:
        if not plan.certain:
            weights = kernels.given_existence(weights, scores, innovation.loglik, it.existence)
        belief = plan.estimator.update(it.belief, innovation, weights)
    if plan.keeps_tracks:
        return new_state(
            it.scan.time, belief, state.memory, None, state.ids, it.existence, state.confirmed, by.weights,
            by.distances, state.born, state.approximated + by.approximated, state.seed, state.steps + 1, None, by.returns,
            None,
        )  # fmt: skip
    rows, unseen, leaves, begun = _of_tracks(it, by, belief) if by.branched is None else _of_leaves(it, by, belief)
    return new_state(
        it.scan.time, rows.belief, rows.memory, unseen, rows.ids, rows.existence, rows.confirmed, rows.weights,
        rows.distances, state.born + begun, state.approximated + by.approximated, state.seed, state.steps + 1, leaves,
        rows.returns, _gates(it, scores, by),
    )  # fmt: skip


def _gates(it: Expected, scores: Array | None, by: Associated) -> Gates | None:
    """Return the returns in the gates of the state's tracks, or leaves; None where no track splits or merges."""
    state = it.state
    if by.branched is not None:
        return Gates(state.ids, state.confirmed, state.born, state.leaves.ids, scores, None, by.branched.newborn.returns)
    if it.plan.permanent or not it.gate.axes:
        return None
    return Gates(state.ids, state.confirmed, state.born, state.ids, scores, by.returns, None)


def _of_branches(it: Expected, innovation: Innovation, parent: Indices, weights: Array) -> Any:
    """Return the belief after the scan of leaves that branched."""
    # Each leaf has its return for certain: there is no existence to condition on.
    return it.plan.estimator.update(pytrees.take(it.belief, parent, 0), pytrees.take(innovation, parent, 0), weights)


def _of_parts(it: Expected, parts: Sequence[Part], weights_of: Sequence[Array]) -> Any:
    """Return the belief after the scan of tracks that met returns in parts, in their order."""
    estimator = it.plan.estimator
    after = []
    for part, weights in zip(parts, weights_of, strict=True):
        if not it.plan.certain:
            prior = it.existence[part.rows, None]
            weights = kernels.given_existence(weights, part.scores, part.innovation.loglik, prior)
        after.append(estimator.update(part.belief, part.innovation, weights))
    joined = after[0]
    for more in after[1:]:
        joined = pytrees.join(joined, more, 0)
    back = np.argsort(np.concatenate([part.rows for part in parts]), kind="stable")
    return pytrees.take(pytrees.take(joined, back, 0), 0, 1)


def _of_leaves(it: Expected, by: Associated, belief: Any) -> tuple[Rows, Any, Leaves, int]:
    """Return the tracks that are shown, the birth's memory, the leaves that stay, and how many tracks begin."""
    assert by.branched is not None
    assert by.seen is not None
    leaves, (_, existence, p_detect) = it.state.leaves, by.seen
    memory, ids, confirmed = pytrees.take((leaves.memory, leaves.ids, leaves.confirmed), by.branched.parent, 0)
    rows = Rows(belief, memory, ids, existence, confirmed, by.weights, by.distances, None)
    return branch_out(it, by.branched, rows, p_detect)


def _of_tracks(it: Expected, by: Associated, belief: Any) -> tuple[Rows, Any, None, int]:
    """Return the tracks that go on and those that begin, the birth's memory, no leaves, and how many begin."""
    plan, state, unseen = it.plan, it.state, it.memory
    memory, existence, confirmed, alive = state.memory, it.existence, state.confirmed, None
    if by.seen is not None:
        hit, existence, p_detect = by.seen
        memory, confirmed, alive = judged(plan, belief, memory, it.dt, existence, hit, p_detect)
    rows = Rows(belief, memory, state.ids, existence, confirmed, by.weights, by.distances, by.returns)
    if alive is not None and np.count_nonzero(alive) < alive.size:
        if alive.ndim > 1:
            told = "runs in lock-step keep their tracks; use one that ends none, such as 'single_target'"
            raise ValueError(f"lifecycle: {told}")
        # What ended is recycled before the birth looks at the scan, so such targets count as missed by it once more.
        rows, unseen = pytrees.take(rows, alive, 0), births.recycled(it, unseen, belief, ~alive, existence)
    if not plan.begins or not isinstance(it.observed, Detections):
        return rows, unseen, None, 0
    unseen = births.looked(it, unseen, by.claims)
    begin = births.newborn(it, by.claims)
    return births.with_newborn(it, rows, begin) if len(begin.returns) else rows, unseen, None, len(begin.returns)
