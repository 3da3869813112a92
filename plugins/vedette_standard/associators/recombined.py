"""The independent targets that are closest to a mixture of hypotheses, whichever target each of these calls which."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Indices, Merging, Mixtures, Space, kernels
from vedette.filters import merged
from vedette.hypotheses import Hypotheses

CERTAIN = 1e-12
"""Existence is taken to be at least so far from 0 and from 1 where its logarithm is compared."""
UNLIKE = -1e6
"""The log density of any leaf under a target that has none."""


MOST_ROUNDS = 50
"""Rounds after which the search ends, though it may not have settled; few problems need ten."""


@frozen(eq=False)
class Several:
    """A cluster of several tracks and hypotheses: its leaves (l,) and tracks (t,), by rows, what hypotheses weigh (h,), and
    the leaf of each track in each (h, t), a place among `leaves`, -1: none.
    """

    leaves: Indices
    tracks: Indices
    weights: Array
    table: Indices


def merged_by_track(hypotheses: Hypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
    """Return one leaf for each track, `recombined`, with its past in the heaviest hypothesis that holds the track."""
    into, leaf, shares = recombined(hypotheses, estimate, existence, state)
    track, rows = hypotheses.track[hypotheses.leaves], hypotheses.rows
    order = np.lexsort((rows, track))
    own = hypotheses.leaves[order[np.diff(track[order], prepend=-1) > 0]]
    return Merging(own, into, leaf, shares, Hypotheses.of(len(own)))


def recombined(hypotheses: Hypotheses, estimate: Gaussian, existence: Array, state: Space) -> tuple[Indices, Indices, Array]:
    """Return the targets (p,), ascending, leaves (p,) and shares (p,) by which targets are made up of leaves.

    In turns, each target gets the moments of its leaves (l, n), and each hypothesis gives its leaves to the targets of its
    cluster anew, such that the Kullback-Leibler divergence of the independent targets from the hypotheses falls. It starts
    from the heaviest hypothesis, and ends when nothing changes.
    """
    open_ = list(_several(hypotheses))
    alone = np.ones(len(hypotheses.track), dtype=bool)
    settled = []
    for cluster in open_:
        alone[cluster.leaves] = False
    held = np.flatnonzero(alone)
    settled.append((hypotheses.track[held], held, hypotheses.probability[held]))
    targets = [np.where(one.table >= 0, np.arange(len(one.tracks)), -1) for one in open_]
    shares = [_first(one) for one in open_]
    for _ in range(MOST_ROUNDS):
        if not open_:
            break
        gains = _gains(open_, shares, estimate, existence, state)
        after = _given(open_, gains)
        shares = [_shares(one, target) for one, target in zip(open_, after, strict=True)]
        moved = [not np.array_equal(one, other) for one, other in zip(targets, after, strict=True)]
        settled += [_in_rows(open_[i], shares[i]) for i, more in enumerate(moved) if not more]
        left = [i for i, more in enumerate(moved) if more]
        open_, targets, shares = [open_[i] for i in left], [after[i] for i in left], [shares[i] for i in left]
    settled += [_in_rows(one, share) for one, share in zip(open_, shares, strict=True)]
    into, leaf, share = (np.concatenate(parts) for parts in zip(*settled, strict=True))
    order = np.lexsort((leaf, into))
    return into[order], leaf[order], share[order]


def _several(hypotheses: Hypotheses) -> Iterator[Several]:
    """Yield the clusters of several tracks and several hypotheses."""
    edges = np.searchsorted(hypotheses.cluster, np.arange(int(hypotheses.cluster.max(initial=-1)) + 2))
    for i in np.flatnonzero(np.diff(edges) > 1).tolist():
        first, last = int(edges[i]), int(edges[i + 1])
        starts = hypotheses.starts[first : last + 1]
        held = hypotheses.leaves[starts[0] : starts[-1]]
        leaves = np.unique(held)
        tracks = np.unique(hypotheses.track[leaves])
        if len(tracks) > 1:
            table = np.full((last - first, len(tracks)), -1)
            row = np.repeat(np.arange(last - first), np.diff(starts))
            table[row, np.searchsorted(tracks, hypotheses.track[held])] = np.searchsorted(leaves, held)
            yield Several(leaves, tracks, hypotheses.weights[first:last], table)


def _in_rows(cluster: Several, shares: Array) -> tuple[Indices, Indices, Array]:
    """Return shares (t, l) of a cluster's own as targets, leaves and shares (p,)."""
    target, leaf = np.nonzero(shares)
    return cluster.tracks[target], cluster.leaves[leaf], shares[target, leaf]


def _first(cluster: Several) -> Array:
    """Return the shares (t, l) of the heaviest hypothesis, and of all of them for the tracks that it does not hold."""
    held = cluster.table[0] >= 0
    shares = _shares(cluster, np.where(cluster.table >= 0, np.arange(len(held)), -1))
    shares[held] = 0.0
    shares[held, cluster.table[0, held]] = 1.0
    return shares


def _shares(cluster: Several, target: Indices) -> Array:
    """Return the weight (t, l) of the hypotheses that give each leaf to each target."""
    shares, held = np.zeros((len(cluster.tracks), len(cluster.leaves))), cluster.table >= 0
    weights = np.broadcast_to(cluster.weights[:, None], held.shape)
    np.add.at(shares, (target[held], cluster.table[held]), weights[held])
    return shares


def _given(clusters: list[Several], gains: list[Array]) -> list[Indices]:
    """Return the target (h, t) that each hypothesis of each cluster gives each of its leaves to, by gains (l, t).

    Clusters of as many tracks are asked at once.
    """
    given: list[Indices] = [one.table for one in clusters]
    sizes = np.array([len(one.tracks) for one in clusters])
    for size in np.unique(sizes).tolist():
        own = np.flatnonzero(sizes == size).tolist()
        leaves, rows = ([len(part) for part in parts] for parts in ([gains[i] for i in own], [given[i] for i in own]))
        table = np.concatenate([given[i] for i in own])
        first = np.repeat(np.cumsum(leaves) - leaves, rows)
        scores = np.concatenate([gains[i] for i in own])
        asked = np.where(table >= 0, table + first[:, None], -1)
        taken = np.where(table >= 0, np.argmax(scores, axis=1)[asked], -1 - np.arange(size))
        twice = np.flatnonzero(np.any(np.diff(np.sort(taken, axis=1), axis=1) == 0, axis=1))
        if len(twice):  # elsewhere the best target of each leaf is another one
            with_miss = np.concatenate([np.full((len(scores), 1), -np.inf), scores], axis=1)
            one_each = np.ones(len(twice), dtype=np.int64)
            taken[twice] = kernels.best_joint(with_miss, asked[twice], one_each)[1] - 1
        for i, part in zip(own, np.split(np.where(table >= 0, taken, -1), np.cumsum(rows)[:-1]), strict=True):
            given[i] = part
    return given


def _gains(clusters: list[Several], shares: list[Array], estimate: Gaussian, existence: Array, state: Space) -> list[Array]:
    """Return how much better each target of a cluster explains a leaf than by being absent (l, t), of each cluster.

    That is the mean over the leaf of the log of the target's Bernoulli density.
    """
    sizes = np.array([share.shape for share in shares])
    starts = np.concatenate([[0], np.cumsum(sizes[:, 0])])
    rows = [np.nonzero(share) for share in shares]
    into = np.concatenate([start + target for start, (target, _) in zip(starts, rows, strict=False)])
    leaf = np.concatenate([one.leaves[own] for one, (_, own) in zip(clusters, rows, strict=True)])
    mass = np.concatenate([share[row] for share, row in zip(shares, rows, strict=True)]) * existence[leaf]
    some = np.bincount(into, mass, starts[-1])
    known = some > CERTAIN
    place = np.cumsum(known) - 1
    own = known[into]
    mixtures = Mixtures(place[into[own]], leaf[own], mass[own] / some[into[own]], int(np.sum(known)))
    targets = merged(estimate, mixtures, state)
    information, volume = _information(targets.cov)

    pairs = [(np.repeat(one.leaves, t), np.tile(start + np.arange(t), len(one.leaves)))
             for one, (t, _), start in zip(clusters, sizes, starts, strict=False)]  # fmt: skip
    leaf, target = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    seen = known[target]
    at, by = leaf[seen], place[target[seen]]
    apart = state.difference(estimate.mean[at], targets.mean[by])
    spread = np.einsum("pij,pij->p", information[by], estimate.cov[at])
    spread += np.einsum("pi,pij,pj->p", apart, information[by], apart)
    log_density = np.full(len(leaf), UNLIKE)
    log_density[seen] = -0.5 * (spread + volume[by])
    probability = np.clip(some, CERTAIN, 1.0 - CERTAIN)[target]
    gains = existence[leaf] * (np.log(probability) + log_density - np.log1p(-probability))
    edges = np.cumsum([len(one) for one, _ in pairs])[:-1]
    return [part.reshape(-1, t) for part, (t, _) in zip(np.split(gains, edges), sizes, strict=True)]


def _information(cov: Array) -> tuple[Array, Array]:
    """Return the inverses of covariances (t, n, n) and log |2 pi cov| (t,), over the axes with variance: those without say
    nothing. A covariance may be singular by rounding.
    """
    root = kernels.bounded_root(cov)
    pivots = np.diagonal(root, axis1=-2, axis2=-1)
    free = pivots > 0
    white = kernels.solve_by_root(root, np.broadcast_to(np.eye(cov.shape[-1]), cov.shape)) * free[:, :, None] * free[:, None]
    log_det = np.sum(np.where(free, np.log(2 * np.pi * np.where(free, pivots, 1.0) ** 2), 0.0), axis=-1)
    return np.swapaxes(white, -1, -2) @ white, log_det
