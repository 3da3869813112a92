"""Clusters in which two tracks may give one return, associated by themselves; all others as if there were none."""

from __future__ import annotations

import numpy as np

from vedette import Array, Indices, kernels
from vedette.tracking import Expected, Meeting, Pairs, by_cluster
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.events import Events

MOST_TRACKS, MOST_RETURNS = 6, 10
"""Clusters with more are associated as if all were resolved, and counted as approximated: their events are too many."""


def associate_close(
    it: Expected, pairs: Pairs, meeting: Meeting, places: tuple[Indices, tuple[Indices, Indices]], most: int | None = None
) -> tuple[Array, Array, tuple[Array, Array, Array], int]:
    """Return what `by_cluster` does, of pairs among which those at `places` are the meeting's, some with partners.

    most: how many events of a cluster count, the likeliest; None: all.
    """
    close: Close = meeting.close
    plan, prior, t = it.plan, it.existence, len(it.existence)
    index = np.full(meeting.returns.shape, -1)
    index[places[1]] = places[0]
    row_of = np.full(t, -1)
    row_of[meeting.rows] = np.arange(len(meeting.rows))
    together = np.zeros(len(pairs.tracks), dtype=bool)
    together[index[:, close.alone :][index[:, close.alone :] >= 0]] = True
    labels = kernels.linked_clusters(pairs.tracks, pairs.returns, t, pairs.k)[:t]
    apart = np.zeros(t, dtype=bool)
    weights, misses, approximated = np.zeros(len(pairs.tracks)), np.ones(t), 0
    hit, existence, p_detect = np.zeros(t), np.array(prior), np.zeros(t)
    for label in np.unique(labels[close.pairs[:, 0]]).tolist():
        tracks = np.flatnonzero(labels == label)
        own = (labels[pairs.tracks] == label) & ~together
        returns = np.unique(pairs.returns[labels[pairs.tracks] == label])
        if len(tracks) > MOST_TRACKS or len(returns) > MOST_RETURNS:
            approximated += len(tracks)
            continue
        apart[tracks] = True
        scores = np.full((len(tracks), 1 + len(returns)), -np.inf)
        at = np.searchsorted(tracks, pairs.tracks[own]), np.searchsorted(returns, pairs.returns[own])
        scores[:, 0], scores[at[0], 1 + at[1]] = pairs.miss[tracks], pairs.scores[own]
        some = np.flatnonzero(np.all(labels[close.pairs] == label, axis=-1))
        members = np.searchsorted(tracks, close.pairs[some])
        joint, resolved = close.joint(some[:, None], returns), close.apart(some, returns)
        events = Events.of(scores, members, joint, resolved).likeliest(most)
        shares, merged = events.marginals(scores.shape, joint.shape)
        misses[tracks], weights[own] = shares[:, 0], shares[at[0], 1 + at[1]]
        for number, pair in enumerate(some.tolist()):
            for side, track in enumerate(close.pairs[pair].tolist()):
                column = close.column(pair, side, returns)
                weights[index[row_of[track], column[column >= 0]]] = merged[number][column >= 0]
        table = np.concatenate([shares, np.zeros((len(tracks), 1))], axis=-1)
        table[:, -1] = np.maximum(1.0 - np.sum(shares, axis=-1), 0.0)
        loglik = np.zeros((len(tracks), table.shape[-1]))
        loglik[:, 0] = pairs.loglik[tracks]
        # What a track gives with another bounds nothing.
        asked = np.concatenate([scores, np.full((len(tracks), 1), np.inf)], axis=-1)
        seen = kernels.existence(asked, table, prior[tracks], loglik, plan.p_gate, True)
        hit[tracks], existence[tracks], p_detect[tracks] = seen
    alone = ~together & ~apart[pairs.tracks]
    weights[alone], lone, seen_alone, more = by_cluster(
        plan.associator, pairs.only(alone), prior, it.observed.evidence, plan.p_gate, plan.lifecycle.permanent
    )
    misses[~apart] = lone[~apart]
    if not plan.lifecycle.permanent:
        for to, values in zip((hit, existence, p_detect), seen_alone, strict=True):
            to[~apart] = values[~apart]
    return weights, misses, (hit, existence, p_detect), approximated + more
