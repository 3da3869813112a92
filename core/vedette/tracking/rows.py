"""Rows of a scan: tracks, or leaves of tracks, with all that a state keeps of each; how the lifecycle judges them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from attrs import evolve, frozen

from vedette.space import Array, Indices, Mask, Space
from vedette.tracking.clusters import tables
from vedette.tracking.expected import Expected
from vedette.tracking.identity import Names
from vedette.tracking.plan import PLANE
from vedette.tracking.state import Look
from vedette.types import Gaussian, new_review
from vedette.values import maker

COVERS = 0.01
"""A scan that should detect a track with less probability did not look at it: by hand."""
FORGETS = 0.9
"""A longer time from look to look is forgotten by so much at each: by hand. An outage of hours, after some hundred looks."""


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
    it: Expected, belief: Any, memory: Any, existence: Array, hit: Array, p_detect: Array, own: Array | None = None
) -> tuple[Any, Mask, Mask]:
    """Return the lifecycle's memory of tracks or leaves after a scan, which are confirmed and which go on.

    own: of leaves, the existence under their own history.
    Those whose existence is no number go on, whatever the lifecycle says: the end of a run tells of them.
    """
    plan, lifecycle = it.plan, it.plan.lifecycle
    awaits = len(it.state.looks) > 1 and np.count_nonzero(p_detect < COVERS) > 0
    estimate: Any = plan.estimator.moments(belief) if lifecycle.needs_spread or lifecycle.needs_place or awaits else None
    spread = _largest_deviation(estimate, plan.state) if lifecycle.needs_spread else None
    place = estimate.mean[..., plan.state.locate(PLANE)] if lifecycle.needs_place else None
    due = _awaited(it, estimate.mean) if awaits else None
    memory, confirmed, alive = lifecycle.review(memory, new_review(it.dt, existence, hit, p_detect, spread, place, due, own))
    return memory, confirmed, alive if np.count_nonzero(alive) == alive.size else alive | np.isnan(existence)


def _largest_deviation(estimate: Gaussian, state: Space) -> Array:
    """Return the largest standard deviation of each position, over the axes of `state` in m: (*b, t)."""
    position = [i for i, axis in enumerate(state.axes) if axis.unit == "m"]
    return np.sqrt(np.linalg.eigvalsh(estimate.cov[..., position, :][..., position])[..., -1])


def _awaited(it: Expected, mean: Array) -> Array:
    """Return the greatest P_D (*b, t) of the other sensors that are to look again, each as it looked last."""
    most = np.zeros(mean.shape[:-1])
    for name, look in it.state.looks.items():
        if name in it.plan.gates and name != it.scan.sensor and it.scan.time <= look.time + look.every:
            sensor = it.plan.gates[name].sensor.placed(look.pose)
            most = np.maximum(most, sensor.detects(mean[..., it.plan.state.locate(sensor.observes)]))
    return most


def looked(it: Expected) -> dict[str, Look]:
    """Return the last look of each sensor after a scan."""
    time, name = it.scan.time, it.scan.sensor
    before = it.state.looks.get(name, Look(time, math.inf, None))
    gap, every = time - before.time, before.every
    if gap > 0:
        every = max(gap, 0.0 if every == math.inf else FORGETS * every)
    return {**it.state.looks, name: Look(time, every, it.scan.pose)}


def compact(rows: TrackRows) -> TrackRows:
    """Return the tracks of one run with the columns of returns that have a weight, and one at least."""
    tracks, returns = np.nonzero(rows.weights[:, 1:])
    taken, apart = rows.weights[tracks, 1 + returns], rows.distances[tracks, returns]
    weights, distances, names = tables(rows.weights[:, 0], tracks, returns, taken, apart)
    return evolve(rows, weights=weights, distances=distances, returns=names)
