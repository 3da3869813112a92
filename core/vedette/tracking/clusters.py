"""Clusters of tracks that share returns, associated as a batch: those of about one size at once."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.hypotheses import LeafScores
from vedette.roles import Associator
from vedette.space import Array, Indices, Mask
from vedette.tracking.memory_limits import check_births, check_clusters


@frozen(eq=False)
class Pairs:
    """Pairs (p,) of a track and a return within its gate, by tracks: their scores and squared distances.

    miss and loglik (t,): each track's score and log likelihood of a miss; k: the scan's number of returns.
    """

    tracks: Indices
    returns: Indices
    scores: Array
    distances: Array
    miss: Array
    loglik: Array
    k: int

    def only(self, some: Indices | Mask) -> Pairs:
        """Return some of the pairs."""
        tracks, returns, scores, distances = self.tracks[some], self.returns[some], self.scores[some], self.distances[some]
        return Pairs(tracks, returns, scores, distances, self.miss, self.loglik, self.k)

    def by_leaf(self) -> LeafScores:
        """Return the scores as those of leaves, one a track; the returns of a track ascend."""
        ends = np.cumsum(np.bincount(self.tracks, minlength=len(self.miss)))
        return LeafScores(self.miss, ends, self.returns, self.scores, self.k)


@frozen(eq=False)
class Taken:
    """The weights of pairs (p,) and of misses (t,) after a scan."""

    pairs: Pairs
    weights: Array
    misses: Array

    def tables(self, rows: Indices, begun: Indices) -> tuple[Array, Array, Indices]:
        """Return weights, distances and returns, as a `State` has them, of some tracks and of those that begin at returns.

        Only these are made, as a track whose gate holds most returns makes them wide.
        """
        pairs, t, place = self.pairs, len(rows), np.full(len(self.misses), -1)
        place[rows] = np.arange(t)
        some = np.flatnonzero(place[pairs.tracks] >= 0)
        row, new = place[pairs.tracks[some]], len(begun)
        check_births(t, new, max(1, int(np.max(np.bincount(row), initial=0))))
        return tables(
            np.append(self.misses[rows], np.zeros(new)),
            np.append(row, t + np.arange(new)),
            np.append(pairs.returns[some], begun),
            np.append(self.weights[some], np.ones(new)),
            np.append(pairs.distances[some], np.zeros(new)),
        )


def tables(misses: Array, rows: Indices, returns: Indices, weights: Array, distances: Array) -> tuple[Array, Array, Indices]:
    """Return weights (t, 1+w), distances and returns (t, w) of pairs (p,) and misses (t,), -1 for none."""
    column = kernels.places(rows, len(misses))
    shape = len(misses), 1 + int(np.max(column, initial=0))
    table, apart, names = np.zeros((shape[0], 1 + shape[1])), np.zeros(shape), np.full(shape, -1)
    table[:, 0], table[rows, 1 + column] = misses, weights
    apart[rows, column], names[rows, column] = distances, returns
    return table, apart, names


@frozen(eq=False)
class Group:
    """Clusters that are padded to one size: which tracks and pairs are in them, and where they come to lie.

    Track i is row `track_place[i]` of cluster `track_cluster[i]`; a pair lies in its cluster's row and column.
    """

    tracks: Mask
    track_at: tuple[Indices, Indices]
    pairs: Mask
    pair_at: tuple[Indices, Indices, Indices]
    shape: tuple[int, int, int]


def by_cluster(
    associator: Associator, pairs: Pairs, prior: Array, evidence: Array | None, p_gate: float, permanent: bool,
    confirmed: Mask | bool = False,
) -> tuple[Array, Array, tuple[Array, Array, Array], int]:  # fmt: skip
    """Return the weights of pairs (p,) and misses (t,), and (t,) detection, existence and P_D, as they were if `permanent`.

    Last is how many tracks' weights are not exact. `prior`: existence before the scan (t,); `confirmed`: who was, of tracks
    that may share a return.
    """
    weights, misses, approximated = np.zeros(len(pairs.tracks)), np.ones(len(prior)), 0
    hit, existence, p_detect = np.zeros(len(prior)), np.array(prior), np.zeros(len(prior))
    if evidence is None and (found := associator.associate_pairs(pairs)) is not None:
        weights, misses, inexact = found
        seen = (hit, existence, p_detect) if permanent else _seen(pairs, weights, misses, prior, p_gate)
        return weights, misses, seen, int(np.count_nonzero(inexact))
    for group in _groups(pairs):
        check_clusters(*group.shape[:2], group.shape[2] - 1)
        scores = np.full(group.shape, -np.inf)
        scores[..., 0] = 0.0
        scores[(*group.track_at, 0)] = pairs.miss[group.tracks]
        scores[group.pair_at] = pairs.scores[group.pairs]
        given = None
        if evidence is not None:
            given = np.zeros((group.shape[0], 1, group.shape[2] - 1))
            given[group.pair_at[0], 0, group.pair_at[2] - 1] = evidence[pairs.returns[group.pairs]]
        before, loglik, firm = np.ones(group.shape[:2]), np.zeros(group.shape), np.zeros(group.shape[:2], dtype=bool)
        before[group.track_at], loglik[(*group.track_at, 0)] = prior[group.tracks], pairs.loglik[group.tracks]
        firm[group.track_at] = np.broadcast_to(confirmed, prior.shape)[group.tracks]
        asked = kernels.if_existing(scores, loglik[..., 0], before) if associator.decides else scores
        shares = associator.associate(asked, given)
        misses[group.tracks], weights[group.pairs] = shares[(*group.track_at, 0)], shares[group.pair_at]
        if associator.approximates:
            approximated += int(np.count_nonzero(associator.approximated(scores)))
        if permanent:
            continue
        seen = seen_in_turn(scores, shares, before, loglik, p_gate, associator.exclusive, firm)
        for to, values in zip((hit, existence, p_detect), seen, strict=True):
            to[group.tracks] = values[group.track_at]
    return weights, misses, (hit, existence, p_detect), approximated


def seen_in_turn(
    scores: Array, weights: Array, prior: Array, loglik: Array, p_gate: float, exclusive: bool, confirmed: Mask
) -> tuple[Array, Array, Array]:
    """Return `kernels.existence` of tracks; unless `exclusive`, confirmed ones claim a return first, then the surer.

    One that was missed for long would lose its target to a new one else. Among equally sure ones it is the one that a return
    fits best, and not that which lies lowest in the axes; of tracks that are all certain the older.
    """
    if exclusive or scores.shape[-2] < 2:
        return kernels.existence(scores, weights, prior, loglik, p_gate, exclusive)
    best = np.where(prior < 1.0, np.max(scores[..., 1:], axis=-1, initial=-np.inf), 0.0)
    order = np.lexsort((-best, -prior, ~confirmed), axis=-1)
    at = order if order.ndim == 1 else (np.arange(len(order))[:, None], order)
    seen = kernels.existence(scores[at], weights[at], prior[at], loglik[at], p_gate, False)
    back = np.argsort(order, axis=-1)
    hit, there, p_detect = (np.take_along_axis(each, back, axis=-1) for each in seen)
    return hit, there, p_detect


def _seen(pairs: Pairs, weights: Array, misses: Array, prior: Array, p_gate: float) -> tuple[Array, Array, Array]:
    """Return detection, existence and P_D of tracks that share no return: all that a track may have taken is one return.

    Its score stands for those of all.
    """
    scores, shares, some, t = np.zeros((len(misses), 1, 2)), np.empty((len(misses), 1, 2)), weights > 0, len(misses)
    ratios = np.exp(np.minimum(pairs.scores - pairs.miss[pairs.tracks], 600.0)[some])
    scores[:, 0, 1] = kernels.safe_log(np.bincount(pairs.tracks[some], ratios, t).astype(float))
    shares[:, 0, 0], shares[:, 0, 1] = misses, np.minimum(np.bincount(pairs.tracks, weights, t), 1.0)
    loglik = np.repeat(pairs.loglik[:, None, None], 2, axis=-1)
    seen = kernels.existence(scores, shares, prior[:, None], loglik, p_gate, True)
    return seen.hit[:, 0], seen.existence[:, 0], seen.p_detect[:, 0]


def _groups(pairs: Pairs) -> Iterator[Group]:
    """Yield all clusters, lone tracks among them, in groups of about one size."""
    t, k = len(pairs.miss), pairs.k
    labels = kernels.linked_clusters(pairs.tracks, pairs.returns, t, k)
    count, of_track, of_return = int(labels.max(initial=-1)) + 1, labels[:t], labels[t:]
    row, column = kernels.places(of_track, count), kernels.places(of_return, count)
    tracks, returns = _rounded(np.bincount(of_track, minlength=count)), _rounded(np.bincount(of_return, minlength=count))
    # One number for both sizes: after rounding up to a power of two, `returns` is below 2 (k + 1).
    size = tracks * (k + 1) * 2 + returns
    size[tracks == 0] = -1
    for value in np.unique(size[of_track]).tolist():
        alike = size == value
        number = np.cumsum(alike) - 1
        some, among = alike[of_track], alike[of_track[pairs.tracks]]
        cluster = of_track[pairs.tracks[among]]
        shape = (int(np.count_nonzero(alike)), int(tracks[alike][0]), 1 + int(returns[alike][0]))
        track_at = number[of_track[some]], row[some]
        pair_at = number[cluster], row[pairs.tracks[among]], 1 + column[pairs.returns[among]]
        yield Group(some, track_at, among, pair_at, shape)


def _rounded(counts: Indices) -> Indices:
    """Return counts between 4 and 32 rounded up to a power of two, so that there are few sizes; others as they are."""
    rounded = 2 ** np.ceil(np.log2(np.maximum(counts, 1))).astype(np.int64)
    return np.where((counts <= 4) | (counts > 32), counts, rounded)
