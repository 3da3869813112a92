"""Which row took which return: probabilities of the meetings, and what they say of existence."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.hypotheses import LeafScores
from vedette.space import Array, Indices
from vedette.tracking import births, pytrees
from vedette.tracking.branching import Branched, branched
from vedette.tracking.clusters import Pairs, Taken, by_cluster, seen_in_turn
from vedette.tracking.expected import Expected
from vedette.tracking.meeting import Meeting, Met
from vedette.types import Detections, Frame
from vedette.values import maker

UNCLAIMED: Array = np.zeros(0)


@frozen(eq=False)
class Associated:
    """What associating a scan's meetings gave.

    weights (*b, t, 1+w), squared distances (*b, t, w) and returns (t, w) or None are as a `State` keeps them
    of_few    of each meeting with few returns, its weights (g, 1, 1+w); None where all rows met all returns
    seen      of each track: the probability of having been detected, its existence, and P_D, of leaves that of
              those that met the scan; None where tracks are permanent
    claims    (k,) the probability that a return is from an existing track
    approximated  number of tracks whose weights are not exact
    branched  the leaves that the associator made of those that met, where it keeps hypotheses
    taken     of pairs within gates: what they took; `weights` are of misses alone, and there are no distances then
    """

    weights: Array
    distances: Array
    returns: Indices | None
    of_few: Sequence[Array] | None
    seen: tuple[Array, Array, Array] | None
    claims: Array
    approximated: int
    branched: Branched | None
    taken: Taken | None


new_associated = maker(Associated)


def associate(it: Expected, met: Met) -> Associated:
    """Return which row took which return; tracks that meet all returns at once, pairs in clusters, leaves as hypotheses."""
    plan, (innovation, scores, meetings) = it.plan, met
    if plan.keeps_hypotheses:
        return _of_leaves(it, met)
    if meetings is not None:
        return _of_pairs(it, meetings)
    framed = not it.gate.axes
    plain = not framed and it.observed.evidence is None
    asked = kernels.if_existing(scores, innovation.loglik[..., 0], it.existence) if plan.decides else scores
    weights = plan.associator.associate(asked, None) if plain else _weighed(it, asked)
    if plan.keeps_tracks and not plan.associator.approximates:
        return new_associated(weights, innovation.nis, None, None, None, UNCLAIMED, 0, None, None)
    seen, claims, approximated = None, UNCLAIMED, 0
    if plan.associator.approximates and not framed:
        approximated = int(np.count_nonzero(plan.associator.approximated(scores)))
    if not plan.lifecycle.permanent:
        apart = plan.associator.exclusive or framed
        seen = seen_in_turn(scores, weights, it.existence, innovation.loglik, plan.p_gate, apart, it.confirmed)
    if plan.begins and not framed:
        claims = kernels.claimed(weights, plan.associator.exclusive)
    return new_associated(weights, innovation.nis, None, None, seen, claims, approximated, None, None)


def _weighed(it: Expected, scores: Array) -> Array:
    """Return the weights (*b, t, 1+k) of returns with evidence, or of a frame: several tracks may appear in it."""
    associator, evidence = it.plan.associator, it.observed.evidence
    if isinstance(it.observed, Frame):
        return associator.associate(scores[..., None, :], None)[..., 0, :]
    return associator.associate(scores, None if evidence is None else evidence[..., None, :])


def _of_leaves(it: Expected, met: Met) -> Associated:
    """Return the leaves after a scan: each has taken one return, or none, for certain."""
    innovation, table, meetings = met
    if meetings is None:
        scores, loglik = LeafScores.of(table), innovation.loglik[:, 0]
    else:
        assert isinstance(it.observed, Detections)
        pairs, places = _within_gates(meetings, len(it.existence), len(it.observed.z))
        if meetings and meetings[0].close is not None:
            there, (_, column) = places[0]
            pairs = pairs.only(np.delete(np.arange(len(pairs.tracks)), there[column >= meetings[0].close.alone]))
        scores, loglik = pairs.by_leaf(), pairs.loglik
    after = branched(it, scores, meetings)
    parent, choice, returns = after.parent, after.choice, None
    hit = (choice > 0).astype(float)
    if meetings is None:
        weights = np.zeros((len(parent), table.shape[-1]))
        weights[range(len(parent)), choice] = 1.0
        distances = innovation.distance[parent]
    else:
        weights, distances, returns = np.stack([1.0 - hit, hit], axis=-1), np.zeros((len(parent), 1)), choice[:, None] - 1
        took, key = after.branching.alone[: len(parent)], pairs.tracks * pairs.k + pairs.returns
        if (merged := after.branching.merged) is not None:
            both = (merged := merged[: len(parent)]) > 0
            at = np.searchsorted(meetings[0].rows, parent[both])
            distances[both, 0] = meetings[0].innovation.nis[at, 0, merged[both] - 1]
        distances[took, 0] = pairs.distances[np.searchsorted(key, parent[took] * pairs.k + choice[took] - 1)]
    prior = it.existence[parent]
    missed = prior * np.exp(loglik[parent])
    absent = 1.0 - prior + missed
    unseen = np.divide(missed, absent, out=np.zeros_like(absent), where=absent > 0)
    seen = hit, np.where(choice > 0, 1.0, unseen), (1.0 - np.exp(loglik)) / it.plan.p_gate
    return Associated(weights, distances, returns, None, seen, after.claims, after.approximated, after, None)


def _of_pairs(it: Expected, met: Sequence[Meeting]) -> Associated:
    """Return the weights of pairs within gates, clusters of tracks that share returns being associated as a batch."""
    plan, observed = it.plan, it.observed
    assert isinstance(observed, Detections)
    t, k = len(it.existence), len(observed.z)
    pairs, places = _within_gates(met, t, k)
    if met[0].close is None:
        weights, misses, seen, approximated = by_cluster(
            plan.associator, pairs, it.existence, observed.evidence, plan.p_gate, plan.lifecycle.permanent, it.confirmed
        )
    else:
        weights, misses, seen, approximated = plan.associator.associate_close(it, pairs, met[0], places[0])
    used = []
    for meeting, (pair, place) in zip(met, places, strict=True):
        table: Array = np.zeros(meeting.scores.shape)
        table[:, 0, 0] = misses[meeting.rows]
        table[:, 0, 1:][place] = weights[pair]
        used.append(table)

    claims = births.claimed_by_pairs(pairs.returns, weights, k, plan.associator.exclusive)
    taken = Taken(pairs, weights, misses)
    return Associated(misses[:, None], np.zeros((t, 0)), None, used, seen, claims, approximated, None, taken)


def _within_gates(met: Sequence[Meeting], t: int, k: int) -> tuple[Pairs, list[tuple[Indices, tuple[Indices, Indices]]]]:
    """Return the pairs within gates by tracks, and where in `Pairs` and in each meeting those of the meeting are."""
    inside, parts, miss, loglik = list[Any](), list[Any](), np.zeros(t), np.zeros(t)
    for meeting in met:
        scores, innovation = meeting.scores[:, 0], meeting.innovation
        row, _ = at = np.nonzero(np.isfinite(scores[:, 1:]))
        inside.append(at)
        parts.append((meeting.rows[row], meeting.returns[at], scores[:, 1:][at], innovation.nis[:, 0][at]))
        miss[meeting.rows], loglik[meeting.rows] = scores[:, 0], innovation.loglik[:, 0, 0]
    owners = [part[0] for part in parts]
    there = np.argsort(np.argsort(np.concatenate(owners), kind="stable"))
    tracks, returns, scores, distances = pytrees.in_order(parts, owners)
    pairs = Pairs(tracks, returns, scores, distances, miss, loglik, k)
    return pairs, list(zip(np.split(there, np.cumsum(list(map(len, owners)))[:-1]), inside, strict=True))
