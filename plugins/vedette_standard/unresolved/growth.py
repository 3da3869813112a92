"""Hypotheses of many scans in which two leaves may give one return.

Each hypothesis is split by the events of its close leaves, which have then decided: each stands for a leaf that can do but
one thing, one of two that give one return taking it. What is split grows as ever, births and truncation too.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from vedette import Array, Branching, Indices, Mask, kernels
from vedette.hypotheses import JointHypotheses, LeafScores
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.clusters import MOST_RETURNS, MOST_TRACKS
from vedette_standard.unresolved.decided import RARER, Decided, of_several, of_single, returns_of

Alternatives = list[tuple[float, tuple[int, ...]]]
"""The hypotheses of a cluster: weights and leaves."""


def grown_close(
    hypotheses: JointHypotheses, scores: LeafScores, begins: Mask, close: Close, most: int, least: float
) -> Branching:
    """Return what `JointHypotheses.grown` does where leaves may give one return with others."""
    cluster, weights, starts, leaves = _joined(hypotheses, close, most, least)
    rows = np.repeat(np.arange(len(weights)), np.diff(starts))
    sets, events = _events(rows, leaves, len(weights), scores, close, least)
    split, share, event = _split(sets, events, RARER * least)

    # The leaves of each: those that have not decided, and those of its events.
    free, own = _free(rows, leaves, sets, events)
    size = np.bincount(free, minlength=len(weights))
    at = kernels.counted(size[split], (np.cumsum(size) - size)[split])
    width = np.bincount(events.event, minlength=len(events.share))
    some, column = np.nonzero(event >= 0)
    made = event[some, column]
    there = kernels.counted(width[made], (np.cumsum(width) - width)[made])
    holder = np.concatenate([np.repeat(np.arange(len(split)), size[split]), np.repeat(some, width[made])])
    weight = weights[split] * share
    undecided = np.zeros((4, len(leaves)), dtype=np.int64)
    undecided[0], undecided[1] = leaves, -1
    decided = np.stack([events.row, events.of[events.event], events.choice, events.column])
    every = np.concatenate([undecided, decided], axis=1)
    every, first, place = np.unique(every, axis=1, return_index=True, return_inverse=True)
    place = place.ravel()
    held = np.concatenate([place[own][at], place[len(leaves) + there]])

    order = np.lexsort((-weight, cluster[split]))
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    inside = np.lexsort((held, rank[holder]))
    ends = np.cumsum(np.bincount(rank[holder], minlength=len(split)))
    wide_cluster = cluster[split][order]
    total = np.bincount(wide_cluster, weight[order])
    wide = JointHypotheses(
        wide_cluster, weight[order] / total[wide_cluster], np.concatenate([[0], ends]), held[inside],
        hypotheses.track[every[0]], hypotheses.past[every[0]],
    )  # fmt: skip
    mine = np.maximum(first - len(leaves), 0)
    asked = _scores_of(every, np.append(events.takes, False)[mine], np.append(events.score, 0.0)[mine], scores)
    return _contracted(wide.grown(asked, begins, most, least), every)


def _split(sets: Indices, events: Decided, least: float) -> tuple[Indices, Array, Indices]:
    """Return which of the hypotheses (h, s) each is that they are split into, its share, and its events (n, s), -1: none."""
    number = np.bincount(events.of, minlength=int(np.max(sets, initial=-1)) + 1)
    first = np.cumsum(number) - number
    split, share, event = np.arange(len(sets)), np.ones(len(sets)), np.zeros((len(sets), 0), dtype=np.int64)
    for column in sets.T:
        mine = column[split]
        count = np.where(mine >= 0, np.append(number, 0)[mine], 1)
        again = np.repeat(np.arange(len(split)), count)
        own = np.where(mine[again] >= 0, kernels.counted(count, np.append(first, 0)[mine]), -1)
        share = share[again] * np.append(events.share, 1.0)[own]
        kept = share > least
        split, share = split[again][kept], share[kept]
        event = np.concatenate([event[again], own[:, None]], axis=1)[kept]
    return split, share, event


def _free(rows: Indices, leaves: Indices, sets: Indices, events: Decided) -> tuple[Indices, Indices]:
    """Return the hypotheses of the leaves that have not decided, and the places of these."""
    decided = np.unique(np.stack([events.of[events.event], events.row]), axis=1)
    most = 1 + int(max(np.max(leaves, initial=0), np.max(decided[1], initial=0)))
    asked = np.where(sets[rows] >= 0, sets[rows] * most + leaves[:, None], -1)
    own = np.flatnonzero(~np.any(np.isin(asked, decided[0] * most + decided[1]), axis=1))
    return rows[own], own


def _events(
    rows: Indices, leaves: Indices, count: int, scores: LeafScores, close: Close, least: float
) -> tuple[Indices, Decided]:
    """Return the sets of close pairs (h, s) of each hypothesis that share no leaf, -1 for none, and the events of these."""
    hypothesis, pair = _pairs_within(rows, leaves, count, scores, close)
    edges = np.cumsum(np.bincount(hypothesis, minlength=count))
    # A lone pair of few returns, as most are, needs no closer look.
    alone, both = np.diff(scores.ends, prepend=0)[close.pairs].sum(axis=1), np.diff(close.ends, prepend=0)
    few = alone + both <= MOST_RETURNS
    known: dict[tuple[int, ...], list[tuple[int, ...]]] = {(i,): [(i,)] for i in np.unique(pair[few[pair]]).tolist()}
    asked, inside = [], pair.tolist()
    for begin, end in pairwise([0, *edges.tolist()]):
        key = tuple(inside[begin:end])
        if key not in known:
            known[key] = _apart(key, scores, close)
        asked.append(known[key])
    every = sorted({one for some in asked for one in some}, key=lambda one: (len(one) > 1, one))
    number = {one: i for i, one in enumerate(every)}
    sets = np.full((count, max(map(len, asked), default=0)), -1)
    for h, some in enumerate(asked):
        sets[h, : len(some)] = [number[one] for one in some]
    single = np.array([one[0] for one in every if len(one) == 1], dtype=np.int64)
    several = [of_several(one, number[one], scores, close, least) for one in every[len(single) :]]
    return sets, Decided.joined([of_single(single, scores, close, least), *several])


def _apart(pairs: tuple[int, ...], scores: LeafScores, close: Close) -> list[tuple[int, ...]]:
    """Return sets of a hypothesis' close pairs that share no leaf and no return, of each as many as allow all events."""
    if len(pairs) < 2:
        return [kept for kept in [_chosen(np.array(pairs, dtype=np.int64), scores, close)] if kept]
    members = close.pairs[list(pairs)]
    leaves, inverse = np.unique(members, return_inverse=True)
    returns = [returns_of(members[i], [pair], scores, close) for i, pair in enumerate(pairs)]
    tracks = np.concatenate([inverse.ravel(), np.repeat(inverse.reshape(-1, 2)[:, 0], [len(one) for one in returns])])
    nodes = np.concatenate([scores.k + np.repeat(np.arange(len(pairs)), 2), *returns])
    label = kernels.linked_clusters(tracks, nodes, len(leaves), scores.k + len(pairs))[inverse.reshape(-1, 2)[:, 0]]
    groups = [np.array(pairs)[label == one] for one in np.unique(label).tolist()]
    return [kept for group in groups if (kept := _chosen(group, scores, close))]


def _pairs_within(rows: Indices, leaves: Indices, count: int, scores: LeafScores, close: Close) -> tuple[Indices, Indices]:
    """Return which hypothesis holds both of which close pair, by hypotheses: (n,), (n,)."""
    from scipy.sparse import csr_array

    usable = np.flatnonzero(close.usable)
    held = csr_array((np.ones(len(leaves)), (rows, leaves)), shape=(count, len(scores.miss))).tocsc()
    i, j = close.pairs[usable].T
    both = held[:, i].multiply(held[:, j]).tocoo()
    order = np.lexsort((both.col, both.row))
    return both.row[order].astype(np.int64), usable[both.col[order]]


def _chosen(inside: Indices, scores: LeafScores, close: Close) -> tuple[int, ...]:
    """Return the likeliest of close pairs, as many as allow all events."""
    kept: list[int] = []
    if _allowed(inside, scores, close):
        return tuple(inside.tolist())
    best = np.full(len(close.pairs), -np.inf)
    np.maximum.at(best, close.pair, close.scores)
    for pair in inside[np.argsort(-best[inside], kind="stable")].tolist():
        if _allowed(np.array([*kept, pair]), scores, close):
            kept.append(pair)
    return tuple(sorted(kept))


def _allowed(pairs: Indices, scores: LeafScores, close: Close) -> bool:
    """Return whether the events of close pairs are not too many."""
    tracks = np.unique(close.pairs[pairs])
    return len(tracks) <= MOST_TRACKS and len(returns_of(tracks, pairs, scores, close)) <= MOST_RETURNS


def _joined(hypotheses: JointHypotheses, close: Close, most: int, least: float) -> tuple[Indices, Array, Indices, Indices]:
    """Return cluster, weights, starts and leaves of hypotheses; those of clusters with close leaves are multiplied."""
    held = list(_products(hypotheses, close, most, least))
    cluster = np.repeat(np.arange(len(held)), [len(part) for part in held])
    size = [len(own) for part in held for _, own in part]
    leaves = np.array([leaf for part in held for _, own in part for leaf in own], dtype=np.int64)
    weights = np.array([weight for part in held for weight, _ in part])
    return cluster, weights, np.cumsum([0, *size]), leaves


def _products(hypotheses: JointHypotheses, close: Close, most: int, least: float) -> Iterator[Alternatives]:
    count = int(hypotheses.cluster.max(initial=-1)) + 1
    every: list[Alternatives] = [[] for _ in range(count)]
    edges = zip(hypotheses.starts.tolist(), hypotheses.starts[1:].tolist(), strict=False)
    for number, weight, (i, j) in zip(hypotheses.cluster.tolist(), hypotheses.weights.tolist(), edges, strict=True):
        every[number].append((weight, tuple(hypotheses.leaves[i:j].tolist())))
    linked = hypotheses.cluster_of[close.pairs[close.usable]]
    pairs = np.arange(len(linked))
    labels = kernels.linked_clusters(linked.ravel(), np.repeat(pairs, 2), count, len(pairs))[:count]
    for label in dict.fromkeys(labels.tolist()):
        first, *others = (every[c] for c in np.flatnonzero(labels == label).tolist())
        product = first
        for held in others:
            both = [(w * v, own + more) for w, own in product for v, more in held]
            both = sorted(both, key=lambda one: -one[0])[:most]
            product = [one for one in both if one[0] > min(least, 0.5 * both[0][0])]
        yield product


def _scores_of(every: Indices, takes: Mask, score: Array, scores: LeafScores) -> LeafScores:
    """Return the log scores of leaves (4, n), as `Decided` has them, of which some have decided."""
    decided, starts = every[1] >= 0, np.concatenate([[0], scores.ends])
    number = np.where(decided, takes, np.diff(starts)[every[0]])
    miss = np.where(decided, np.where(takes, -np.inf, score), scores.miss[every[0]])
    own = np.repeat(np.arange(len(miss)), number)
    at = np.where(decided[own], len(scores.returns), kernels.counted(number, starts[every[0]]))
    taken = np.where(decided[own], every[2][own] - 1, np.append(scores.returns, 0)[at])
    gain = np.where(decided[own], score[own], np.append(scores.scores, 0.0)[at])
    return LeafScores(miss, np.cumsum(number), taken, gain, scores.k)


def _contracted(grown: Branching, every: Indices) -> Branching:
    """Return the branching of the leaves that there were, those that decided alike being one."""
    after, begun = grown.hypotheses, grown.parent < 0
    real, decided, choices, columns = every[:, grown.parent]
    choice = np.where(begun | (decided < 0), grown.choice, choices)
    merged = np.where(begun, 0, columns)
    parent = np.where(begun, np.max(every[0], initial=-1) + 1, real)
    _, first, row = np.unique(np.stack([parent, choice, merged]), axis=1, return_index=True, return_inverse=True)
    leaves = row.ravel()[after.leaves]
    order = np.lexsort((leaves, after.rows))
    hypotheses = JointHypotheses(
        after.cluster, after.weights, after.starts, leaves[order], after.track[first], after.past[first]
    )
    lost = None if grown.lost is None else grown.lost[first]
    return Branching(np.where(begun, -1, parent)[first], choice[first], hypotheses, lost, merged=merged[first])
