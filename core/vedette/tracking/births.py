"""How tracks begin: the birth is asked, and its tracks are joined to those that are there."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from attrs import evolve

from vedette.space import Array, Indices, Mask
from vedette.tracking import pytrees
from vedette.tracking.expected import Expected
from vedette.tracking.identity import begun, without_second
from vedette.tracking.memory_limits import LEAST_PAIRS, LEAST_STARTED, check_births, check_started
from vedette.tracking.own_times import at_the_scan, moments_of
from vedette.tracking.rows import TrackRows, compact
from vedette.types import Detections, Newborn


def claimed_by_pairs(returns: Indices, weights: Array, k: int, exclusive: bool) -> Array:
    """Return what `kernels.claimed` does (k,) from the returns (p,) of pairs and their weights (p,)."""
    if exclusive:
        return np.minimum(np.bincount(returns, weights, minlength=k), 1.0)
    free = np.ones(k)
    np.multiply.at(free, returns, 1.0 - weights)
    return 1.0 - free


def newborn(it: Expected, claims: Array, inside: Mask | None = None) -> Newborn:
    """Return the tracks that begin at a scan's returns, by the probability (k,) that each is from an existing track.

    inside (k,): which returns are within some gate, where claims do not say it.
    """
    plan, name, n = it.plan, it.scan.sensor, len(it.plan.state)
    if plan.birth is None or name not in plan.starters or not isinstance(it.observed, Detections) or not len(it.observed.z):
        return Newborn.none(n)
    if claims.ndim > 1:
        raise ValueError(f"birth: no track begins in runs in lock-step, got claims of shape {claims.shape}")
    sources, seen = None if it.undetected is None else it.undetected.sources, it.observed
    if seen.time is None:
        begin = plan.birth.begin(sources, plan.estimator, it.sensor, name, seen, claims)
    else:
        parts, every = [], moments_of(it.scan, seen, it.dt)
        for (_, _, some), source in zip(every, [None] * len(every) if sources is None else sources, strict=True):
            then = pytrees.take(seen, some, 0)
            part = plan.birth.begin(source, plan.estimator, it.sensor, name, then, claims[some])
            parts.append(evolve(part, returns=some[part.returns]))
        begin = pytrees.in_order(parts, [part.returns for part in parts])
    if not (np.isfinite(begin.prior.mean).all() and np.isfinite(begin.prior.cov).all()):
        raise ValueError("birth: must begin tracks with finite means and covariances")
    if plan.offsets is not None and it.offsets is not None:
        begin = plan.offsets.begun(it.sensor, begin, it.offsets)
    if not plan.associator.exclusive:  # the first of two has the return that they share, whatever a scan's order
        begin = pytrees.take(begin, np.lexsort((*begin.prior.mean.T, -begin.existence)), 0)
    return without_second(plan.identity, it.names, it.observed.identity, begin, inside)


def looked(it: Expected, unseen: Any, claims: Array) -> Any:
    """Return the birth's memory `unseen` after its targets were looked at by a scan, whose returns are claimed (k,)."""
    plan, starts = it.plan, it.rate is None or it.scan.sensor in it.plan.starters  # else none gets a track
    if plan.birth is None or not plan.models_unseen or not isinstance(it.observed, Detections) or not starts:
        return unseen
    return plan.birth.update(unseen, plan.estimator, it.sensor, it.observed, claims, plan.p_gate)


def recycled(it: Expected, unseen: Any, belief: Any, ended: Mask, mass: Array) -> Any:
    """Return the birth's memory with what is left of the rows that `ended`: their probabilities `mass`, of all rows."""
    plan = it.plan
    if plan.birth is None or not plan.models_unseen:
        return unseen
    return plan.birth.recycle(unseen, plan.estimator, plan.estimator.moments(pytrees.take(belief, ended, 0)), mass[ended])


def with_newborn(it: Expected, rows: TrackRows, begin: Newborn) -> TrackRows:
    """Return tracks with those that begin, which come last; ScanRefused if they are more than fit into memory."""
    plan, count = it.plan, len(begin.returns)
    if count >= LEAST_STARTED:  # one is started by a copy of the generator, which stays as it is
        one = plan.estimator.start(pytrees.take(begin.prior, slice(1), 0), plan.state, deepcopy(it.rng))
        check_started(one, len(plan.state), count)
    existence = np.ones(count) if plan.lifecycle.certain else begin.existence
    return joined(it, rows, begin, it.state.born + np.arange(count), existence)


def joined(
    it: Expected, rows: TrackRows, begin: Newborn, ids: Indices, existence: Array, of_track: Array | None = None
) -> TrackRows:
    """Return rows, then one for each of those that begin, each with its return for certain.

    of_track: the existence by which the lifecycle knows them, where that is less than their own.
    """
    plan, count = it.plan, len(ids)
    if rows.returns is None and (len(rows.ids) + count) * rows.distances.shape[-1] >= LEAST_PAIRS:
        rows = compact(rows)
    k = rows.distances.shape[-1]
    check_births(len(rows.ids), count, k)
    weights, returns = np.zeros((count, 1 + k)), None
    if k:  # else what rows took is told by pairs
        weights[np.arange(count), 1 + begin.returns if rows.returns is None else 1] = 1.0
    if rows.returns is not None:
        returns = np.full((count, k), -1)
        returns[:, 0] = begin.returns
    belief = plan.estimator.start(begin.prior, plan.state, it.rng)
    if it.observed.time is not None:
        ago = np.minimum(it.scan.time - it.observed.time[begin.returns], it.dt)
        belief = at_the_scan(plan.estimator, belief, ago, it.rng)
    memory = plan.lifecycle.start(existence if of_track is None else of_track)
    unconfirmed = np.zeros(count, dtype=bool)
    names = None if rows.names is None else begun(plan.identity, it.observed, begin.returns)
    new = TrackRows(belief, memory, ids, existence, unconfirmed, weights, np.zeros((count, k)), returns, names)
    return pytrees.join(rows, new, 0)
