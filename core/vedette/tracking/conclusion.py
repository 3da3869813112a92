"""The end of a step, for all layouts: rows are updated and judged, some end, some begin, and the next state is made."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vedette import kernels
from vedette.space import Array
from vedette.tracking import births, trees
from vedette.tracking.association import Associated
from vedette.tracking.branching import branch_out
from vedette.tracking.expected import Expected
from vedette.tracking.meeting import Met
from vedette.tracking.rows import Rows, judged, new_rows
from vedette.tracking.state import State, new_state
from vedette.types import Detections


def conclude(it: Expected, met: Sequence[Met], by: Associated) -> State:
    """Return the state after a scan."""
    plan, state, table = it.plan, it.state, by.table
    belief, unseen, leaves = _updated(it, met, by), it.unseen, None
    if by.branched is not None:
        rows, leaves, unseen = branch_out(it, by.branched, belief, table, by.seen)
        born = state.born + len(by.branched.newborn.returns)
    else:
        rows = new_rows(belief, state.memory, state.ids, it.existence, state.confirmed, *table)
        if by.seen is not None:
            rows, unseen = _reviewed(it, rows, *by.seen)
        born = state.born
        if plan.begins and isinstance(it.observed, Detections):
            unseen = births.looked(it, unseen, by.claims)
            begin = births.newborn(it, by.claims)
            born += len(begin.returns)
            rows = births.with_newborn(it, rows, begin) if len(begin.returns) else rows
    return new_state(
        it.scan.time, rows.belief, rows.memory, unseen, rows.ids, rows.existence, rows.confirmed, rows.weights,
        rows.distances, born, state.approximated + by.approximated, state.seed, state.steps + 1, leaves, rows.returns,
        by.gates,
    )  # fmt: skip


def _updated(it: Expected, met: Sequence[Met], by: Associated) -> Any:
    """Return the belief of the rows after the scan, in the order of the rows that were expected or branched."""
    plan, first = it.plan, met[0]
    if by.branched is not None:
        parent = by.branched.parent
        return plan.estimator.update(
            trees.take(first.belief, parent, 0), trees.take(first.innovation, parent, 0), by.weights[0]
        )
    if first.rows is None:
        return _posterior(it, first, by.weights[0], it.existence)
    after = [
        _posterior(it, part, weights, it.existence[part.rows, None]) for part, weights in zip(met, by.weights, strict=True)
    ]
    joined = after[0]
    for more in after[1:]:
        joined = trees.join(joined, more, 0)
    back = np.argsort(np.concatenate([part.rows for part in met]), kind="stable")
    return trees.take(trees.take(joined, back, 0), 0, 1)


def _posterior(it: Expected, met: Met, weights: Array, existence: Array) -> Any:
    """Return the belief after a meeting: that of a target that exists, by the weights given that it does."""
    if not it.plan.certain:
        weights = kernels.given_existence(weights, met.scores, met.innovation.loglik, existence)
    return it.plan.estimator.update(met.belief, met.innovation, weights)


def _reviewed(it: Expected, rows: Rows, hit: Array, existence: Array, p_detect: Array) -> tuple[Rows, Any]:
    """Return the tracks that go on, as the lifecycle judges them, and the birth's memory with what is left of others."""
    memory, confirmed, alive = judged(it.plan, rows.belief, rows.memory, it.dt, existence, hit, p_detect)
    after = new_rows(rows.belief, memory, rows.ids, existence, confirmed, rows.weights, rows.distances, rows.returns)
    if np.count_nonzero(alive) == alive.size:
        return after, it.unseen
    if alive.ndim > 1:
        raise ValueError("lifecycle: runs in lock-step keep their tracks; use one that ends none, such as 'single_target'")
    # What ended is recycled before the birth looks at the scan, so such targets count as missed by it once more.
    return trees.take(after, alive, 0), births.recycled(it, it.unseen, rows.belief, ~alive, existence)
