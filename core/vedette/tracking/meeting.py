"""Which rows meet which returns of a scan: all of them, or of many only those within the boxes around the gates.

A row is a track, or a leaf of one where the associator keeps hypotheses. Of many tracks and returns, those with about as
many returns in their boxes are a batch of runs of one track each, so that estimators and the gate meet the shapes that
they always do.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.errors import ScanRefused
from vedette.kernels.boxes import by_width
from vedette.space import Array, Indices
from vedette.tracking import pytrees
from vedette.tracking.expected import Expected
from vedette.tracking.identity import weighed
from vedette.tracking.memory_limits import FEW, check_pairs, is_sparse, most_pairs, refused
from vedette.tracking.plan import untimed
from vedette.types import Detections, Innovation


@frozen(eq=False)
class Meeting:
    """Rows (g,) that met `returns` (g, w) of their own, -1 for none, each as a run of one row: scores (g, 1, 1+w).

    close: of rows that an associator which takes merged returns met by itself, what it needs to weigh them.
    """

    rows: Indices
    returns: Indices
    belief: Any
    innovation: Innovation
    scores: Array
    close: Any = None


Met: TypeAlias = tuple[Any, Any, tuple[Meeting, ...] | None]
"""How rows met returns: innovation of their belief, log scores (*b, t, 1+k) with the miss in column 0, and None, if all
rows met all returns. Or each row met few: None, None, and the meetings of rows with as many returns each.

A plain tuple, as a value of its own would cost a step 2 % of its time.
"""


def meet(it: Expected) -> Met:
    """Return how rows and returns met: all with all, or where there are many, those that may be within gates."""
    plan, observed = it.plan, it.observed
    if observed.time is not None:
        if why := untimed(plan) if it.existence.ndim == 1 else "runs go in lock-step":
            told = "leave it out, as scans.own_times = false does of a stream, and all are of the scan's"
            raise ScanRefused(f"time: returns have none of their own where {why}: {told}")
        check_pairs(it.state, it.scan, len(plan.state))
    elif it.scan.sensor in plan.coarse and (close := plan.associator.meet_close(it)) is not None:
        return None, None, (close, *_met_by_others(it, it.scan.detections, close.rows))
    elif it.scan.detections.z.size > FEW and is_sparse(plan, it.state, it.scan) and isinstance(observed, Detections):
        return None, None, tuple(_of_few(it, observed, *few) for few in _candidates(it, observed))
    innovation = it.innovation
    scores = plan.gate.scores(innovation, it.sensor, observed, it.existence, it.gate, it.rate, it.confirmed)
    if observed.identity is not None:
        scores = weighed(plan.identity, it.names, observed.identity, scores)
    return innovation, scores, None


def _met_by_others(it: Expected, observed: Detections, rows: Indices) -> list[Meeting]:
    """Return the meetings of all rows but some."""
    others, k = np.setdiff1d(np.arange(len(it.existence)), rows), len(observed.z)
    if not is_sparse(it.plan, it.state, it.scan):
        every = np.broadcast_to(np.where(observed.valid, np.arange(k), -1), (len(others), k))
        return [_of_few(it, observed, others, every)] if len(others) else []
    kept = [(some, met, np.isin(some, others)) for some, met in _candidates(it, observed)]
    return [_of_few(it, observed, some[far], met[far]) for some, met, far in kept if far.any()]


def _candidates(it: Expected, observed: Detections) -> list[tuple[Indices, Indices]]:
    """Return groups of tracks (g,) with the returns (g, w) in the box around each one's gate, -1 where it has fewer."""
    t = len(it.existence)
    low, high = it.plan.estimator.extent(it.belief, it.sensor, observed, it.reach)
    most = most_pairs(it.belief, t, len(it.plan.state))
    tracks, returns = kernels.pairs_in_boxes(low, high, observed.z, it.sensor.measurement.periods, most)
    if len(tracks) > most:
        raise refused(t, len(observed.z), most)
    if not observed.valid.all():
        counts = observed.valid[returns]
        tracks, returns = tracks[counts], returns[counts]
    returns = np.append(returns, -1)
    return [(rows, returns[np.where(there, at, -1)]) for rows, at, there in by_width(np.bincount(tracks, minlength=t))]


def _of_few(it: Expected, observed: Detections, rows: Indices, returns: Indices) -> Meeting:
    """Return the meeting of tracks, as runs of one track each, with returns of their own."""
    belief = pytrees.take(it.belief, rows[:, None], 0)
    evidence = None if observed.evidence is None else observed.evidence[returns]
    detections = Detections(observed.z[returns], returns >= 0, evidence, observed.noise_of(returns))
    innovation = it.plan.estimator.evaluate(belief, it.sensor, detections, it.plan.p_gate)
    return Meeting(rows, returns, belief, innovation, scores_of_few(it, rows, returns, innovation, detections))


def scores_of_few(it: Expected, rows: Indices, returns: Indices, innovation: Innovation, seen: Detections) -> Array:
    """Return the log scores (g, 1, 1+w) of rows (g,) that met returns (g, w) of their own, -1 for none, as those `seen`."""
    rate = None if it.rate is None else it.rate[returns][:, None, :]
    scores = it.plan.gate.scores(
        innovation, it.sensor, seen, it.existence[rows, None], it.gate, rate, it.confirmed[rows, None]
    )
    if (names := it.observed.identity) is not None:
        codes = np.where(returns >= 0, names[returns], -1)
        scores = weighed(it.plan.identity, pytrees.take(it.names, rows[:, None], 0), codes, scores)
    return scores
