"""The independent targets that are closest to a mixture of hypotheses, whichever target each of these calls which."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Indices, Mask, Merging, Mixtures, Space, kernels
from vedette.filters import merged
from vedette.hypotheses import JointHypotheses

CERTAIN = 1e-12
"""Existence is taken to be at least so far from 0 and from 1 where its logarithm is compared."""
UNLIKE = -1e6
"""The log density of any leaf under a target that has none."""
WIDEST = 1000.0
"""What gains in a hypothesis may differ by in all: `kernels.best_joint` scores no miss lower than 3000 below the best."""

MOST_ROUNDS = 50
"""Rounds after which the search ends, though it may not have settled; few problems need ten."""

LARGEST = 2e8
"""Hypotheses of a cluster times the cube of its tracks, beyond which every leaf stays its track's, as `jpda` has it.

A round of assignments grows so, and takes half a second there. By hand: 100 tracks that hang together, in 200 hypotheses.
"""


@frozen(eq=False)
class Several:
    """Clusters (c,) of several hypotheses and of the same number t of tracks each, more than one.

    tracks (c, t), and leaves (l,) by rows, of the cluster `of` (l,). In the hypotheses (h,), of weights (h,) and of the
    cluster `cluster` (h,), which ascends, each track has the leaf table (h, t), a place among `leaves`, -1: none.
    """

    tracks: Indices
    leaves: Indices
    of: Indices
    weights: Array
    cluster: Indices
    table: Indices

    def only(self, some: Mask) -> Several:
        """Return some (c,) of the clusters."""
        number, leaves, rows = np.cumsum(some) - 1, some[self.of], some[self.cluster]
        table = self.table[rows]
        table = np.where(table >= 0, (np.cumsum(leaves) - 1)[table], -1)
        of, cluster = number[self.of[leaves]], number[self.cluster[rows]]
        return Several(self.tracks[some], self.leaves[leaves], of, self.weights[rows], cluster, table)


def merged_by_track(hypotheses: JointHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
    """Return one leaf for each track, `recombined`, with its past in the heaviest hypothesis that holds the track."""
    into, leaf, shares = recombined(hypotheses, estimate, existence, state)
    track, rows = hypotheses.track[hypotheses.leaves], hypotheses.rows
    order = np.lexsort((rows, track))
    first = hypotheses.leaves[order[np.diff(track[order], prepend=-1) > 0]]
    return Merging(first, into, leaf, shares, JointHypotheses.of(len(first)))


def recombined(
    hypotheses: JointHypotheses, estimate: Gaussian, existence: Array, state: Space
) -> tuple[Indices, Indices, Array]:
    """Return the targets (p,), ascending, leaves (p,) and shares (p,) by which targets are made up of leaves.

    In turns, each target gets the moments of its leaves (l, n), and each hypothesis gives its leaves to the targets of its
    cluster anew, such that the Kullback-Leibler divergence of the independent targets from the hypotheses falls. It starts
    from the heaviest hypothesis, and ends when nothing changes. Clusters beyond `LARGEST` are not recombined.
    """
    parts = list(_several(hypotheses))
    alone = np.ones(len(hypotheses.track), dtype=bool)
    for part in parts:
        alone[part.leaves] = False
    held = np.flatnonzero(alone)
    settled = [(hypotheses.track[held], held, hypotheses.probability[held])]
    open_ = []
    for part in parts:
        if _work(part) <= LARGEST:
            open_.append(part)
        else:
            settled.append(_in_rows(part, _shares(part, _own(part)), np.ones(len(part.tracks), dtype=bool)))
    targets = [_own(part) for part in open_]
    shares = [_first(part) for part in open_]
    for _ in range(MOST_ROUNDS):
        if not open_:
            break
        rounds = list(zip(open_, targets, _gains(open_, shares, estimate, existence, state), strict=True))
        open_, targets, shares = [], [], []
        for part, old, gain in rounds:
            target = _given(part, gain)
            share = _shares(part, target)
            moved = np.bincount(part.cluster, np.any(target != old, axis=1)) > 0
            settled.append(_in_rows(part, share, ~moved))
            if moved.any():
                open_.append(part.only(moved))
                targets.append(target[moved[part.cluster]])
                shares.append(share[moved[part.of]])
    settled += [_in_rows(part, share, np.ones(len(part.tracks), bool)) for part, share in zip(open_, shares, strict=True)]
    into, leaf, share = (np.concatenate(parts) for parts in zip(*settled, strict=True))
    order = np.lexsort((leaf, into))
    return into[order], leaf[order], share[order]


def _several(hypotheses: JointHypotheses) -> Iterator[Several]:
    """Yield the clusters of several tracks and several hypotheses, those of as many tracks at once."""
    track, leaves, rows, cluster = hypotheses.track, hypotheses.leaves, hypotheses.rows, hypotheses.cluster
    of_track = np.full(int(track.max(initial=-1)) + 1, -1)
    of_track[track[leaves]] = cluster[rows]
    asked = np.bincount(leaves, minlength=len(track)) > 0
    size = np.bincount(of_track[of_track >= 0], minlength=int(cluster.max(initial=-1)) + 1)
    size[np.bincount(cluster, minlength=len(size)) < 2] = 0
    place = np.zeros(len(of_track), dtype=np.int64)
    for t in np.unique(size[size > 1]).tolist():
        mine = size == t
        some, asked_here, at = mine[cluster], asked & mine[of_track[track]], mine[cluster[rows]]
        among = np.flatnonzero(mine[of_track] & (of_track >= 0))
        tracks = among[np.argsort(of_track[among], kind="stable")].reshape(-1, t)
        place[tracks] = np.arange(t)
        number, row, leaf = np.cumsum(mine) - 1, np.cumsum(some) - 1, np.cumsum(asked_here) - 1
        table = np.full((np.count_nonzero(some), t), -1)
        table[row[rows[at]], place[track[leaves[at]]]] = leaf[leaves[at]]
        held = np.flatnonzero(asked_here)
        of = number[of_track[track[held]]]
        yield Several(tracks, held, of, hypotheses.weights[some], number[cluster[some]], table)


def _work(part: Several) -> float:
    """Return how much a round of assignments takes in the largest of the clusters."""
    return float(np.max(np.bincount(part.cluster))) * float(part.tracks.shape[1]) ** 3


def _in_rows(part: Several, shares: Array, some: Mask) -> tuple[Indices, Indices, Array]:
    """Return shares (l, t) of some (c,) of the clusters as targets, leaves and shares (p,)."""
    leaf, target = np.nonzero(shares * some[part.of, None])
    return part.tracks[part.of[leaf], target], part.leaves[leaf], shares[leaf, target]


def _own(part: Several) -> Indices:
    """Return the target (h, t) of each leaf in each hypothesis if each stays that of its track."""
    return np.where(part.table >= 0, np.arange(part.table.shape[1]), -1)


def _first(part: Several) -> Array:
    """Return the shares (l, t) of each heaviest hypothesis, and of all of them for the tracks that it does not hold."""
    best = part.table[np.diff(part.cluster, prepend=-1) > 0]
    held = best >= 0
    shares = _shares(part, _own(part))
    shares[held[part.of]] = 0.0
    shares[best[held], np.nonzero(held)[1]] = 1.0
    return shares


def _shares(part: Several, target: Indices) -> Array:
    """Return the weight (l, t) of the hypotheses that give each leaf to each target."""
    held, t = part.table >= 0, part.table.shape[1]
    weights = np.broadcast_to(part.weights[:, None], held.shape)[held]
    shares = np.bincount(part.table[held] * t + target[held], weights, len(part.leaves) * t).astype(float)
    return shares.reshape(-1, t)


def _given(part: Several, gains: Array) -> Indices:
    """Return the target (h, t) that each hypothesis gives each of its leaves to, by gains (l, t)."""
    table, t = part.table, part.table.shape[1]
    taken = np.where(table >= 0, np.argmax(gains, axis=1)[table], -1 - np.arange(t))
    twice = np.flatnonzero(np.any(np.diff(np.sort(taken, axis=1), axis=1) == 0, axis=1))
    if len(twice):  # elsewhere the best target of each leaf is another one
        # Else a miss may do better than a target without a leaf. A scale by a power of 2 rounds nothing.
        spread = t * float(np.max(np.ptp(gains, axis=1)))
        scale = np.exp2(min(0.0, np.floor(np.log2(WIDEST / (spread + 1.0)))))
        with_miss = np.concatenate([np.full((len(gains), 1), -np.inf), scale * gains], axis=1)
        one_each = np.ones(len(twice), dtype=np.int64)
        taken[twice] = kernels.best_joint(with_miss, table[twice], one_each)[1] - 1
    return np.where(table >= 0, taken, -1)


def _gains(parts: list[Several], shares: list[Array], estimate: Gaussian, existence: Array, state: Space) -> list[Array]:
    """Return how much better each target of a cluster explains a leaf than by being absent (l, t), of each part.

    That is the mean over the leaf of the log of the target's Bernoulli density.
    """
    starts = np.cumsum([0, *(part.tracks.size for part in parts)])
    rows = [np.nonzero(share) for share in shares]
    first = [start + part.tracks.shape[1] * part.of for start, part in zip(starts, parts, strict=False)]
    into = np.concatenate([at[leaf] + target for at, (leaf, target) in zip(first, rows, strict=True)])
    leaf = np.concatenate([part.leaves[rows_of] for part, (rows_of, _) in zip(parts, rows, strict=True)])
    mass = np.concatenate([share[row] for share, row in zip(shares, rows, strict=True)]) * existence[leaf]
    some = np.bincount(into, mass, starts[-1])
    known = some > CERTAIN
    place = np.cumsum(known) - 1
    rows_of = known[into]
    mixtures = Mixtures(place[into[rows_of]], leaf[rows_of], mass[rows_of] / some[into[rows_of]], int(np.sum(known)))
    targets = merged(estimate, mixtures, state)
    information, volume = _information(targets.cov)

    target = np.concatenate([
        (at[:, None] + np.arange(part.tracks.shape[1])).ravel() for at, part in zip(first, parts, strict=True)
    ])  # fmt: skip
    leaf = np.concatenate([np.repeat(part.leaves, part.tracks.shape[1]) for part in parts])
    seen = known[target]
    at, by = leaf[seen], place[target[seen]]
    apart = state.difference(estimate.mean[at], targets.mean[by])
    outer = estimate.cov[at] + apart[:, :, None] * apart[:, None, :]
    log_density = np.full(len(leaf), UNLIKE)
    log_density[seen] = -0.5 * (np.einsum("pij,pij->p", information[by], outer) + volume[by])
    probability = np.clip(some, CERTAIN, 1.0 - CERTAIN)[target]
    gains = existence[leaf] * (np.log(probability) + log_density - np.log1p(-probability))
    edges = np.cumsum([share.size for share in shares])[:-1]
    return [part.reshape(share.shape) for part, share in zip(np.split(gains, edges), shares, strict=True)]


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
