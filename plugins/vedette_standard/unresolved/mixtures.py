"""Tracks that are mixtures of leaves, two of which may give one return."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, kernels
from vedette.hypotheses import LeafScores
from vedette_standard.unresolved.close import SURE, Close
from vedette_standard.unresolved.clusters import MOST_RETURNS, MOST_TRACKS
from vedette_standard.unresolved.events import Events


@frozen(eq=False)
class Together:
    """The leaves (n,) that gave one return with another: their parent, choice and `merged` column, as of a `Branching`, and
    their share; and the probability (k,) that a return is of two tracks.
    """

    parent: Indices
    choice: Indices
    merged: Indices
    share: Array
    returns: Array

    @classmethod
    def of(
        cls,
        track: Indices,
        log_weight: Array,
        leaves: LeafScores,
        tracks: LeafScores,
        close: Close,
        misses: Array,
        taken: Array,
    ) -> Together:
        """Return them by all joint events of the clusters of tracks with close leaves, whose marginals are set anew.

        track and log_weight (l,): of each leaf; leaves, tracks: the scores of leaves and of the mixtures that tracks are;
        misses (t,) and taken (p,): the marginals of these, without returns for two.
        """
        k, owner = tracks.k, tracks.leaf
        # A pair's log score of each return, its leaves' weights counted.
        weight = np.sum(log_weight[close.pairs], axis=1)
        of = track[close.pairs]
        share = _shares(track, leaves, tracks, log_weight)
        returns, found, masses = np.zeros(k), [], list[Array]([np.zeros(0)])
        for members, pairs in _clusters(of, tracks, close.usable):
            at = np.flatnonzero(np.isin(owner, members))
            used = np.union1d(tracks.returns[at], close.returned(pairs))
            if len(members) > MOST_TRACKS or len(used) > MOST_RETURNS:
                continue
            table = np.full((len(members), 1 + len(used)), -np.inf)
            table[:, 0] = tracks.miss[members]
            cell = np.searchsorted(members, owner[at]), 1 + np.searchsorted(used, tracks.returns[at])
            table[cell] = tracks.scores[at]
            # By pairs of tracks.
            pairs = pairs[np.argsort(of[pairs] @ [len(tracks.miss), 1], kind="stable")]
            new = np.any(np.diff(of[pairs], axis=0, prepend=-1), axis=1)
            both, which, starts = of[pairs][new], np.cumsum(new) - 1, np.flatnonzero(new)
            joint = close.joint(pairs[:, None], used) + weight[pairs, None]
            total = np.logaddexp.reduceat(joint, starts)
            # That two tracks were not resolved, if each gave one: the mean over their leaves by what each then is.
            merged = -np.expm1(close.apart(pairs, used))
            i, j = close.pairs[pairs].T
            merged *= share[i[:, None], used][:, :, None] * share[j[:, None], used][:, None]
            apart = np.log1p(-np.minimum(np.add.reduceat(merged, starts), 1.0 - SURE))
            events = Events.of(table, np.searchsorted(members, both), total, apart)
            single, shared = events.marginals(table.shape, total.shape)
            misses[members], taken[at] = single[:, 0], single[cell]
            returns[used] += np.sum(shared, axis=0)
            top = np.where(np.isfinite(total), total, 0.0)
            part = shared[which] * np.exp(joint - top[which])
            pair, place = np.nonzero(part)
            choice = 1 + used[place]
            for side in range(2):
                row, column = close.pairs[pairs[pair], side], 1 + close.column(pairs[pair], side, choice - 1)
                found.append(np.stack([row, choice, of[pairs[pair], 1 - side], column]))
                masses.append(part[pair, place])
        taking, mass = np.concatenate([np.zeros((4, 0), dtype=np.int64), *found], axis=1), np.concatenate(masses)
        # Of another track's leaves, the likeliest says what the return for both says of a leaf: each by itself would be
        # too light to be kept.
        order = np.lexsort((-mass, *taking[2::-1]))
        first, into = np.unique(taking[:3, order], axis=1, return_index=True, return_inverse=True)[1:]
        parent, choice, _, column = taking[:, order[first]]
        return cls(parent, choice, column, np.bincount(into.ravel(), mass[order], len(first)).astype(float), returns)


def _shares(track: Indices, leaves: LeafScores, tracks: LeafScores, log_weight: Array) -> Array:
    """Return the share (l, k) of each leaf in its track, if this gave a return."""
    key = tracks.leaf * tracks.k + tracks.returns
    at = np.searchsorted(key, track[leaves.leaf] * tracks.k + leaves.returns)
    share = np.zeros((len(track), tracks.k))
    some = np.isfinite(tracks.scores[at])
    log = log_weight[leaves.leaf] + leaves.scores - np.where(some, tracks.scores[at], 0.0)
    share[leaves.leaf, leaves.returns] = np.where(some, np.exp(np.where(some, log, 0.0)), 0.0)
    return share


def _clusters(of: Indices, tracks: LeafScores, usable: Mask) -> Iterator[tuple[Indices, Indices]]:
    """Yield the tracks of each cluster with close leaves, and the numbers of the pairs of these."""
    some = np.flatnonzero(usable)
    t, count = len(tracks.miss), len(some)
    linked = np.append(tracks.leaf, of[some].ravel())
    nodes = np.append(tracks.returns, tracks.k + np.repeat(np.arange(count), 2))
    labels = kernels.linked_clusters(linked, nodes, t, tracks.k + count)[:t]
    for label in np.unique(labels[of[some, 0]]).tolist():
        yield np.flatnonzero(labels == label), some[labels[of[some, 0]] == label]
