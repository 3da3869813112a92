"""A scan of many tracks and returns: work is on pairs within gates, in clusters of tracks that share returns.

A grid finds the returns in the box around each track's gate. Tracks are then a batch of runs of one track each, whose
returns are those in its box; and clusters are a batch of runs, whose tracks and returns are their own. So estimators, the
gate and associators meet the shapes that they always do.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.roles import Sensor
from vedette.space import Array, Indices
from vedette.supporting import Lifecycle
from vedette.tracking import births, trees
from vedette.tracking.ceiling import most_pairs, refused
from vedette.tracking.clusters import Pairs, associate
from vedette.tracking.gate import SensorGate
from vedette.tracking.lineage import Gates
from vedette.tracking.state import State, new_state
from vedette.types import Detections, Innovation, Scan


class Parts(births.Parts, Protocol):
    """A tracker that concludes a scan."""

    @property
    def lifecycle(self) -> Lifecycle: ...

    def reviewed(self, state: State, gates: Gates | None, dt: float, hit: Array, existence: Array, p_detect: Array) -> State:
        """Return the state with its tracks judged."""


@frozen(eq=False)
class Predicted:
    """The predicted belief of tracks that exist with the probabilities (t,), and the scan that they meet.

    rate (k,), unseen and found are the birth's: the rate of each return, its memory, and what it found to begin tracks with.
    """

    belief: Any
    existence: Array
    sensor: Sensor
    gate: SensorGate
    observed: Detections
    rate: Array | None
    unseen: Any
    found: Any


@frozen(eq=False)
class Part:
    """Tracks (g,) that are worked on with as many returns each: `index` (g, w) of them, -1 for none; scores (g, 1, 1+w)."""

    tracks: Indices
    index: Indices
    belief: Any
    innovation: Innovation
    scores: Array


@frozen(eq=False)
class Met:
    """What came of a scan: the belief after it, the pairs and their weights, and per track (t,) what existence follows from.

    weights (t, 1+w), distances (t, w) and returns (t, w): the pairs as a `State` keeps them.
    """

    belief: Any
    weights: Array
    distances: Array
    returns: Indices
    seen: tuple[Array, Array, Array]
    claims: Array
    approximated: int


def meet(tracker: Parts, it: Predicted) -> Met:
    """Return what a scan makes of the tracks that meet it."""
    t, k = len(it.existence), len(it.observed.z)
    parts = [_evaluated(tracker, it, tracks, index) for tracks, index in _candidates(tracker, it)]
    pairs, places = _within_gates(parts, t, k)
    weights, misses, seen, approximated = associate(
        tracker.associator, pairs, it.existence, it.observed.evidence, tracker.gate.probability, tracker.lifecycle.permanent
    )
    after = [
        _updated(tracker, part, it.existence, weights[own], misses, place)
        for part, (own, place) in zip(parts, places, strict=True)
    ]
    joined = after[0]
    for more in after[1:]:
        joined = trees.join(joined, more, 0)
    back = np.argsort(np.concatenate([part.tracks for part in parts]), kind="stable")
    joined = trees.take(trees.take(joined, back, 0), 0, 1)

    column = pairs.column()
    width = 1 + int(np.max(column, initial=0))
    table, distances, returns = np.zeros((t, 1 + width)), np.zeros((t, width)), np.full((t, width), -1)
    table[:, 0] = misses
    table[pairs.tracks, 1 + column], distances[pairs.tracks, column] = weights, pairs.distances
    returns[pairs.tracks, column] = pairs.returns
    claims = births.claimed_by_pairs(pairs.returns, weights, k, tracker.associator.exclusive)
    return Met(joined, table, distances, returns, seen, claims, approximated)


def concluded(
    tracker: Parts, state: State, scan: Scan, dt: float, it: Predicted, met: Met, rng: np.random.Generator
) -> State:
    """Return the state after the scan: tracks judged, ended and begun."""
    after = new_state(
        scan.time, met.belief, state.memory, it.unseen, state.ids, it.existence, state.confirmed, met.weights,
        met.distances, state.born, state.approximated + met.approximated, state.seed, state.steps + 1, None, met.returns,
        None,
    )  # fmt: skip
    if not tracker.lifecycle.permanent:
        gates = Gates(state.ids, state.confirmed, state.born, state.ids, None, met.returns, None)
        after = tracker.reviewed(after, gates, dt, *met.seen)
    if tracker.birth is None:
        return after
    return births.begin_unclaimed(tracker, after, it.found, it.sensor, scan.sensor, it.observed, met.claims, rng)


def _candidates(tracker: Parts, it: Predicted) -> list[tuple[Indices, Indices]]:
    """Return groups of tracks (g,) with the returns (g, w) in the box around each one's gate, -1 where it has fewer."""
    t, observed = len(it.existence), it.observed
    low, high = tracker.estimator.extent(it.belief, it.sensor, observed, it.gate.threshold)
    most = most_pairs(it.belief, t, len(tracker.state))
    tracks, returns = kernels.pairs_in_boxes(low, high, observed.z, it.sensor.measurement.periods, most)
    if len(tracks) > most:
        raise refused(t, len(observed.z), most)
    if not observed.valid.all():
        counts = observed.valid[returns]
        tracks, returns = tracks[counts], returns[counts]
    number = np.bincount(tracks, minlength=t)
    starts = np.cumsum(number) - number
    width = np.where(number > 1, 2 ** np.ceil(np.log2(np.maximum(number, 1))).astype(np.int64), 1)
    groups = []
    for w in np.unique(width).tolist():
        own = np.flatnonzero(width == w)
        place = np.arange(w)
        filled = place < number[own, None]
        at = np.where(filled, starts[own, None] + place, 0)
        groups.append((own, np.where(filled, returns[at] if len(returns) else -1, -1)))
    return groups


def _evaluated(tracker: Parts, it: Predicted, tracks: Indices, index: Indices) -> Part:
    """Return tracks as runs of one track each, evaluated against returns of their own."""
    own, observed = trees.take(it.belief, tracks[:, None], 0), it.observed
    evidence = None if observed.evidence is None else observed.evidence[index]
    noise = None if observed.noise is None else observed.noise[index]
    detections = Detections(observed.z[index], index >= 0, evidence, noise)
    innovation = tracker.estimator.evaluate(own, it.sensor, detections, tracker.gate.probability)
    rates = None if it.rate is None else it.rate[index][:, None, :]
    scores = tracker.gate.scores(innovation, it.sensor, detections, it.existence[tracks, None], it.gate, rates)
    return Part(tracks, index, own, innovation, scores)


def _within_gates(parts: list[Part], t: int, k: int) -> tuple[Pairs, list[tuple[Indices, tuple[Indices, Indices]]]]:
    """Return the pairs within gates by tracks, and where in `Pairs` and in each part those of the part are."""
    places: list[Any] = [np.nonzero(np.isfinite(part.scores[:, 0, 1:])) for part in parts]
    tracks = np.concatenate([part.tracks[row] for part, (row, _) in zip(parts, places, strict=True)])
    order = np.argsort(tracks, kind="stable")
    there = np.empty_like(order)
    there[order] = np.arange(len(order))
    edges = np.cumsum([0, *(len(row) for row, _ in places)])
    miss, loglik = np.zeros(t), np.zeros(t)
    for part in parts:
        miss[part.tracks], loglik[part.tracks] = part.scores[:, 0, 0], part.innovation.loglik[:, 0, 0]

    def gathered(values: list[Any]) -> Any:
        return np.concatenate(values)[order]

    pairs = Pairs(
        tracks[order],
        gathered([part.index[place] for part, place in zip(parts, places, strict=True)]),
        gathered([part.scores[:, 0, 1:][place] for part, place in zip(parts, places, strict=True)]),
        gathered([part.innovation.nis[:, 0][place] for part, place in zip(parts, places, strict=True)]),
        miss,
        loglik,
        k,
    )
    return pairs, [(there[i:j], place) for i, j, place in zip(edges, edges[1:], places, strict=False)]


def _updated(
    tracker: Parts, part: Part, existence: Array, weights: Array, misses: Array, place: tuple[Indices, Indices]
) -> Any:
    """Return the belief of a part's tracks after the scan, by the weights of its pairs and of all tracks' misses."""
    used: Array = np.zeros(part.scores.shape)
    used[:, 0, 0] = misses[part.tracks]
    used[:, 0, 1:][place] = weights
    if not tracker.lifecycle.certain:
        used = kernels.given_existence(used, part.scores, part.innovation.loglik, existence[part.tracks, None])
    return tracker.estimator.update(part.belief, part.innovation, used)
