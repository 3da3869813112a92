"""Rows of a scan: tracks, or leaves of tracks, with all that a state keeps of each; how the lifecycle judges them."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices, Mask, Space
from vedette.tracking.clusters import places
from vedette.tracking.identity import Names
from vedette.tracking.plan import PLANE, Plan
from vedette.types import Gaussian, new_review
from vedette.values import maker


@frozen(eq=False)
class TrackRows:
    """Tracks or leaves (*b, t) after a scan: belief, the lifecycle's memory, ids (t,), and the rest as in a `State`."""

    belief: Any
    memory: Any
    ids: Indices
    existence: Array
    confirmed: Mask
    weights: Array
    distances: Array
    returns: Indices | None
    names: Names | None = None


new_track_rows = maker(TrackRows)


def judged(
    plan: Plan, belief: Any, memory: Any, dt: float, existence: Array, hit: Array, p_detect: Array
) -> tuple[Any, Mask, Mask]:
    """Return the lifecycle's memory of tracks or leaves after a scan, which are confirmed and which go on.

    Those whose existence is no number go on, whatever the lifecycle says: the end of a run tells of them.
    """
    lifecycle = plan.lifecycle
    estimate: Any = plan.estimator.moments(belief) if lifecycle.needs_spread or lifecycle.needs_place else None
    spread = _largest_deviation(estimate, plan.state) if lifecycle.needs_spread else None
    place = estimate.mean[..., plan.state.locate(PLANE)] if lifecycle.needs_place else None
    memory, confirmed, alive = lifecycle.review(memory, new_review(dt, existence, hit, p_detect, spread, place))
    return memory, confirmed, alive if np.count_nonzero(alive) == alive.size else alive | np.isnan(existence)


def _largest_deviation(estimate: Gaussian, state: Space) -> Array:
    """Return the largest standard deviation of each position, over the axes of `state` in m: (*b, t)."""
    position = [i for i, axis in enumerate(state.axes) if axis.unit == "m"]
    deviation: Array = np.sqrt(np.linalg.eigvalsh(estimate.cov[..., position, :][..., position])[..., -1])
    return deviation


def compact(rows: TrackRows) -> TrackRows:
    """Return the tracks of one run with the columns of returns that have a weight, and one at least."""
    tracks, returns = np.nonzero(rows.weights[:, 1:])
    column = places(tracks, len(rows.ids))
    width = 1 + int(np.max(column, initial=0))
    weights, distances = np.zeros((len(rows.ids), 1 + width)), np.zeros((len(rows.ids), width))
    names = np.full((len(rows.ids), width), -1)
    weights[:, 0] = rows.weights[:, 0]
    weights[tracks, 1 + column], names[tracks, column] = rows.weights[tracks, 1 + returns], returns
    distances[tracks, column] = rows.distances[tracks, returns]
    return evolve(rows, weights=weights, distances=distances, returns=names)
