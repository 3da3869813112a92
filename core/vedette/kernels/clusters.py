"""Hypotheses of clusters: how those of a cluster grow by a scan, and what of them is left when leaves end.

A cluster is a set of tracks whose associations depend on each other. All clusters lie in flat arrays: `cluster` (h,) of each
hypothesis, ascending from 0; `weights` (h,), which sum to 1 in a cluster, heaviest first; `starts` (h+1,), where in
`leaves` (m,) those of each begin, ascending rows of leaves.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vedette.kernels.assignment import FARTHEST, best_joint
from vedette.kernels.boxes import linked_clusters
from vedette.kernels.reference import log_sum
from vedette.kernels.results import Grown, Shed
from vedette.space import Array, Indices, Mask

MOST_OPERATIONS = 4096
"""Operations that the sum over all associations of one hypothesis may take; where it takes more, it is bounded instead."""

Alternatives = list[tuple[float, tuple[int, ...]]]


def grow(
    cluster: Indices,
    weights: Array,
    starts: Indices,
    leaves: Indices,
    miss: Array,
    ends: Indices,
    returns: Indices,
    scores: Array,
    begins: Mask,
    most: int,
    least: float,
) -> Grown:
    """Return the hypotheses after a scan: cluster, weights, starts, leaves, the code of each, and what is lost (c,).

    miss (l,): log score of a miss; `returns` and `scores` (p,) of each leaf's pairs, which end at `ends` (l,); begins (k,):
    whether a track begins at a return that nothing takes. Clusters that share a return are joined: their hypotheses are
    multiplied and the `most` heaviest products kept. A hypothesis of weight w has its ceil(w most) best associations; the
    `most` heaviest of a cluster above `least` stay. A code is leaf (1+k) + choice, of a track that begins l (1+k) + choice.
    Lost is the share of all associations' weight that is dropped, or a bound of it where the sum would take long.
    Reid, An Algorithm for Tracking Multiple Targets, IEEE Trans. Automatic Control 24, 1979.
    """
    k, table = len(begins), _Table(miss, ends, returns, scores, len(begins))
    clusters: list[tuple[Alternatives, float]] = []
    touched = np.zeros(k, dtype=bool)
    for group in _joined(cluster, weights, starts, leaves, table):
        before, kept = _product(group, most, least)
        within = np.unique(np.concatenate([table.of(leaf)[0] for _, held in before for leaf in held] or [np.zeros(0, int)]))
        touched[within] = True
        after, share = _associated(before, table, most, least)
        clusters.append((_begun(after, within[begins[within]], len(miss), 1 + k), 1.0 - kept * share))
    lone = np.flatnonzero(begins & ~touched)
    clusters += [([(1.0, (code,))], 0.0) for code in (len(miss) * (1 + k) + 1 + lone).tolist()]
    return Grown(*_flat([held for held, _ in clusters]), np.array([lost for _, lost in clusters]))


def shed(
    cluster: Indices, weights: Array, starts: Indices, leaves: Indices, track: Indices, alive: Mask, tolerance: float
) -> Shed:
    """Return the hypotheses without leaves that ended, and the rows of those that stay.

    Equal hypotheses are merged, and clusters split into independent ones.

    track (l,) and alive (l,) of each leaf. Tracks part where the product of their parts changes the hypotheses' weights by
    no more than `tolerance` in total variation. A cluster without a leaf is dropped.
    """
    clusters = []
    for held in _of_clusters(cluster, weights, starts, leaves):
        merged = _merged([(weight, tuple(leaf for leaf in leaves_of if alive[leaf])) for weight, leaves_of in held])
        clusters += _factors(merged, track, tolerance) if any(leaves_of for _, leaves_of in merged) else []
    return _flat(clusters)


def target_existence(weights: Array, starts: Indices, leaves: Indices, track: Indices, own: Array, names: Indices) -> Array:
    """Return the existence (l,) of each leaf's target over all hypotheses, from the leaves' own (l,).

    In each hypothesis it is that of the leaf's track, or without that of the leaves of equal `names` (l,).
    """
    _, number = np.unique(names, return_inverse=True)
    total = np.zeros(len(own))
    for weight, begin, end in zip(weights, starts[:-1], starts[1:], strict=True):
        held = leaves[begin:end]
        of_track, of_name = (np.bincount(of[held], weight * own[held], len(own)) for of in (track, number))
        there = np.bincount(track[held], minlength=len(own)) > 0
        total += np.where(there[track], of_track[track], of_name[number])
    return np.minimum(total, 1.0)


class _Table:
    """Log scores of leaves by pairs, with every miss possible."""

    def __init__(self, miss: Array, ends: Indices, returns: Indices, scores: Array, k: int) -> None:
        self.miss, self.k, self._returns, self._scores = np.array(miss), k, returns, scores
        self._starts = np.concatenate([[0], ends])
        for leaf, score in enumerate(miss.tolist()):
            pairs = self.of(leaf)[1]
            self.miss[leaf] = max(score, (max(score, float(pairs.max())) if len(pairs) else 0.0) - FARTHEST)

    def of(self, leaf: int) -> tuple[Indices, Array]:
        """Return the returns and scores of a leaf's pairs."""
        pairs = slice(self._starts[leaf], self._starts[leaf + 1])
        return self._returns[pairs], self._scores[pairs]

    def dense(self, leaves: tuple[int, ...]) -> tuple[Array, Indices]:
        """Return the scores (t, 1+j) of leaves, and the returns (j,) that they may take."""
        used = np.unique(np.concatenate([self.of(leaf)[0] for leaf in leaves] or [np.zeros(0, dtype=np.int64)]))
        table = np.full((len(leaves), 1 + len(used)), -np.inf)
        for row, leaf in enumerate(leaves):
            returns, scores = self.of(leaf)
            table[row, 0], table[row, 1 + np.searchsorted(used, returns)] = self.miss[leaf], scores
        return table, used


def _of_clusters(cluster: Indices, weights: Array, starts: Indices, leaves: Indices) -> Iterator[Alternatives]:
    """Yield the hypotheses of each cluster, as weight and leaves."""
    rows = [tuple(leaves[i:j].tolist()) for i, j in zip(starts[:-1].tolist(), starts[1:].tolist(), strict=True)]
    for number in range(int(cluster.max(initial=-1)) + 1):
        yield [(float(weights[h]), rows[h]) for h in np.flatnonzero(cluster == number).tolist()]


def _joined(cluster: Indices, weights: Array, starts: Indices, leaves: Indices, table: _Table) -> list[list[Alternatives]]:
    """Return the clusters that share returns together, in the order of their first ones."""
    every = list(_of_clusters(cluster, weights, starts, leaves))
    pairs = [(c, r) for c, held in enumerate(every) for _, rows in held for leaf in rows for r in table.of(leaf)[0].tolist()]
    of, returns = np.array(pairs, dtype=np.int64).reshape(-1, 2).T
    labels = linked_clusters(of, returns, len(every), table.k)[: len(every)]
    return [[every[c] for c in np.flatnonzero(labels == label)] for label in dict.fromkeys(labels.tolist())]


def _heaviest(weights: Array, most: int, least: float) -> Indices:
    """Return the rows of the `most` heaviest, of those above `least`, and of the heaviest."""
    order = np.argsort(-weights, kind="stable")[:most]
    return order[weights[order] > min(least, 0.5 * weights[order[0]])]


def _product(group: list[Alternatives], most: int, least: float) -> tuple[Alternatives, float]:
    """Return the heaviest products of the hypotheses of clusters, and the share of all weight that they have."""
    product, kept = group[0], 1.0
    for held in group[1:]:
        pairs = [(w * v, rows_of + others) for w, rows_of in product for v, others in held]
        weights = np.array([weight for weight, _ in pairs])
        rows = _heaviest(weights, most, least)
        total, kept = float(np.sum(weights[rows])), kept * float(np.sum(weights[rows]))
        product = [(pairs[row][0] / total, pairs[row][1]) for row in rows.tolist()]
    return [(weight, tuple(sorted(rows_of))) for weight, rows_of in product], kept


def _associated(before: Alternatives, table: _Table, most: int, least: float) -> tuple[list[tuple[float, Indices]], float]:
    """Return the weight and codes of the best associations of hypotheses, and the share of all weight that they have."""
    logs, codes, totals = [], [], []
    for weight, leaves in before:
        dense, used = table.dense(leaves)
        wanted = int(np.ceil(most * weight))
        _, choice, gain = best_joint(dense, np.arange(len(leaves))[None], np.array([wanted]))
        names = np.concatenate([[0], 1 + used])
        codes += list(np.array(leaves, dtype=np.int64) * (1 + table.k) + names[choice])
        logs.append(np.log(weight) + gain)
        every = float(log_sum(gain)) if len(gain) < wanted else max(_log_total(dense), float(log_sum(gain)))
        totals.append(np.log(weight) + every)
    log_weight = np.concatenate(logs)
    weights = np.exp(log_weight - np.max(log_weight))
    whole, kept = float(np.sum(np.exp(np.array(totals) - np.max(log_weight)))), float(np.sum(weights))
    weights /= kept
    rows = _heaviest(weights, most, least)
    share = float(np.sum(weights[rows]))
    return [(float(weights[row] / share), codes[row]) for row in rows.tolist()], min(share * kept / whole, 1.0)


def _log_total(scores: Array) -> float:
    """Return log of the sum over all joint associations of scores (t, 1+j), or a bound of it where that takes long."""
    scores = scores[np.isfinite(scores[:, 1:]).any(axis=1) | np.isfinite(scores[:, 0])]
    shared = np.flatnonzero(np.isfinite(scores[:, 1:]).sum(axis=0) > 1)
    top = scores.max(axis=1, initial=-np.inf)
    likely = np.exp(scores - top[:, None])
    stay = likely.sum(axis=1) - likely[:, 1 + shared].sum(axis=1)
    if len(shared) > 30 or np.count_nonzero(likely[:, 1 + shared]) * 2 ** len(shared) > MOST_OPERATIONS:
        return float(np.sum(top) + np.sum(np.log(likely.sum(axis=1))))
    sums = np.zeros(2 ** len(shared))
    sums[0], sets = 1.0, np.arange(len(sums))
    for row, rest in zip(likely[:, 1 + shared], stay, strict=True):
        after = sums * rest
        for i, weight in enumerate(row):
            free = (sets & (1 << i)) == 0
            after[sets[free] | (1 << i)] += weight * sums[free]
        sums = after
    return float(np.sum(top) + np.log(np.sum(sums)))


def _begun(after: list[tuple[float, Indices]], may: Indices, count: int, columns: int) -> Alternatives:
    """Return the hypotheses with the tracks that begin at returns which they leave free."""
    held = []
    for weight, codes in after:
        free = may[~np.isin(1 + may, codes % columns)]
        held.append((weight, (*np.sort(codes).tolist(), *(count * columns + 1 + free).tolist())))
    return held


def _merged(held: Alternatives) -> Alternatives:
    """Return hypotheses without repetitions, heaviest first."""
    total: dict[tuple[int, ...], float] = {}
    for weight, leaves in held:
        total[leaves] = total.get(leaves, 0.0) + weight
    if len(total) == len(held):
        return held
    return [(weight, leaves) for leaves, weight in sorted(total.items(), key=lambda one: -one[1])]


def _factors(held: Alternatives, track: Indices, tolerance: float) -> list[Alternatives]:
    """Return the independent parts of a cluster, in the order of their first leaves."""
    tracks = sorted({int(track[leaf]) for _, leaves in held for leaf in leaves})
    weights, place = np.array([weight for weight, _ in held]), {one: i for i, one in enumerate(tracks)}
    table = np.full((len(held), len(tracks)), -1)
    for row, (_, leaves) in enumerate(held):
        table[row, [place[int(track[leaf])] for leaf in leaves]] = leaves
    label = np.arange(len(tracks))
    for a in range(len(tracks)):
        for b in range(a):
            if label[a] != label[b] and _beyond([table[:, [b]], table[:, [a]]], weights) > tolerance:
                label[label == max(label[a], label[b])] = min(label[a], label[b])
    parts = [np.flatnonzero(label == one) for one in np.unique(label)]
    if len(parts) > 1:
        fixed = [part for part in parts if np.all(table[:, part] == table[:1, part])]
        others = [part for part in parts if not np.all(table[:, part] == table[:1, part])]
        if len(others) > 1 and _beyond([table[:, part] for part in others], weights) > tolerance:
            others = [np.sort(np.concatenate(others))]
        parts = sorted(fixed + others, key=lambda part: int(part[0]))
    return [_merged_part(table[:, part], weights) for part in parts]


def _merged_part(table: Indices, weights: Array) -> Alternatives:
    """Return the hypotheses over some of a cluster's tracks."""
    rows = [tuple(leaf for leaf in row if leaf >= 0) for row in table.tolist()]
    return _merged(list(zip(weights.tolist(), rows, strict=True)))


def _beyond(parts: list[Indices], weights: Array) -> float:
    """Return the total variation of a joint distribution from the product of those of its parts, each (h, t)."""
    numbers, product = [], np.ones(len(weights))
    for part in parts:
        which = np.unique(part, axis=0, return_inverse=True)[1].ravel()
        product *= np.bincount(which, weights)[which]
        numbers.append(which)
    _, first, which = np.unique(np.stack(numbers, axis=1), axis=0, return_index=True, return_inverse=True)
    joint = np.bincount(which.ravel(), weights)
    return float(np.sum(np.maximum(joint - product[first], 0.0)))


def _flat(clusters: list[Alternatives]) -> Shed:
    """Return the hypotheses of clusters in flat arrays, their leaves by rows, and what each row stands for."""
    every = [(number, weight, leaves) for number, held in enumerate(clusters) for weight, leaves in held]
    sizes = np.array([len(leaves) for *_, leaves in every], dtype=np.int64)
    codes, rows = np.unique(np.array([leaf for *_, leaves in every for leaf in leaves], dtype=np.int64), return_inverse=True)
    return Shed(
        np.array([number for number, *_ in every], dtype=np.int64),
        np.array([weight for _, weight, _ in every]),
        np.concatenate([[0], np.cumsum(sizes)]),
        rows.astype(np.int64),
        codes,
    )
