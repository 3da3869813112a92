"""Hypotheses of many scans in which two leaves may give one return."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from attrs import field, frozen

from vedette import Array, Branching, Indices, Mask, kernels
from vedette.hypotheses import Hypotheses, LeafScores
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.clusters import MOST_RETURNS, MOST_TRACKS
from vedette_standard.unresolved.events import Events

RARER = 0.01
"""Events of a hypothesis' close leaves are dropped below this part of the weight at which hypotheses are."""


Held = list[tuple[float, tuple[int, ...]]]
"""The hypotheses of a cluster: weights and leaves."""


NO_RETURNS = np.zeros(0, dtype=np.int64)


@frozen(order=True)
class Leaf:
    """A leaf of a hypothesis, its row; and what it has decided on, if it is one of a set of close `pairs`.

    It gives the return `choice`, from 1, alone or with another, or 0, is missed. column: of a return for two, 0 of others.
    takes: whether it takes the return of this number, which one of two does. score: its log score.
    """

    row: int
    pairs: tuple[int, ...] = ()
    choice: int = 0
    column: int = 0
    takes: bool = False
    score: float = 0.0


def grown_close(
    hypotheses: Hypotheses, scores: LeafScores, begins: Mask, close: Close, most: int, least: float
) -> Branching:
    """Return what `Hypotheses.grown` does where leaves may give one return with others.

    Each hypothesis is split by the events of its close leaves, which have then decided: each stands for a leaf that can do
    but one thing, one of two that give one return taking it. What is split grows as ever, births and truncation too.
    """
    split = _Split(scores, close)
    parts = [split.of(held, least) for held in _joined(hypotheses, close, most, least)]
    rows, weights, cluster = list[list[Leaf]](), list[float](), list[int]()
    for number, part in enumerate(parts):
        total = sum(weight for weight, _ in part)
        for weight, own in sorted(part, key=lambda one: -one[0]):
            rows.append(own)
            weights.append(weight / total)
            cluster.append(number)
    every = sorted({one for own in rows for one in own})
    place = {one: i for i, one in enumerate(every)}
    leaves = [np.sort([place[one] for one in own]) for own in rows]
    real = np.array([one.row for one in every], dtype=np.int64)
    wide = Hypotheses(
        np.array(cluster), np.array(weights), np.cumsum([0, *map(len, leaves)]), np.concatenate(leaves).astype(np.int64),
        hypotheses.track[real], hypotheses.past[real],
    )  # fmt: skip
    return _contracted(wide.grown(_scores_of(every, scores), begins, most, least), every, real)


@frozen(eq=False)
class _Split:
    """Hypotheses split by the events of their close leaves, each set of these once."""

    scores: LeafScores
    close: Close
    found: dict[tuple[int, ...], list[tuple[float, list[Leaf]]]] = field(factory=dict)

    def of(self, held: Held, least: float) -> list[tuple[float, list[Leaf]]]:
        """Return the weights of hypotheses and their leaves, some of which have decided."""
        split = []
        for weight, own in held:
            pairs = self._pairs(own)
            if pairs not in self.found:
                self.found[pairs] = self._events(pairs, least)
            decided = {leaf for pair in pairs for leaf in self.close.pairs[pair].tolist()}
            free = [Leaf(leaf) for leaf in own if leaf not in decided]
            split += [(weight * share, free + leaves) for share, leaves in self.found[pairs]]
        return split

    def _pairs(self, own: tuple[int, ...]) -> tuple[int, ...]:
        """Return the close pairs of a hypothesis' leaves, the likeliest first, as many as allow all events."""
        inside = np.flatnonzero(np.all(np.isin(self.close.pairs, own), axis=1))
        likely = np.max(self.close.joint[inside], axis=1, initial=-np.inf)
        inside = inside[np.argsort(-likely, kind="stable")][: np.count_nonzero(np.isfinite(likely))]
        kept: list[int] = []
        for pair in inside.tolist():
            tracks = np.unique(self.close.pairs[[*kept, pair]])
            if len(tracks) <= MOST_TRACKS and len(self._returns(tracks, [*kept, pair])) <= MOST_RETURNS:
                kept.append(pair)
        return tuple(sorted(kept))

    def _returns(self, leaves: Indices, pairs: list[int]) -> Indices:
        """Return the returns that leaves may give, alone or with another."""
        alone = self.scores.returns[np.isin(self.scores.leaf, leaves)]
        both = np.flatnonzero(np.isfinite(self.close.joint[pairs]).any(axis=0))
        return np.union1d(alone, both)

    def _events(self, chosen: tuple[int, ...], least: float) -> list[tuple[float, list[Leaf]]]:
        """Return the share of each event of close leaves, and these as they have decided in it."""
        if not chosen:
            return [(1.0, [])]
        close, scores, pairs = self.close, self.scores, np.array(chosen)
        assert close.columns is not None
        leaves = np.unique(close.pairs[pairs])
        returns = self._returns(leaves, list(chosen))
        table = np.full((len(leaves), 1 + len(returns)), -np.inf)
        table[:, 0] = scores.miss[leaves]
        own = np.flatnonzero(np.isin(scores.leaf, leaves))
        at = np.searchsorted(leaves, scores.leaf[own]), 1 + np.searchsorted(returns, scores.returns[own])
        table[at] = scores.scores[own]
        members = np.searchsorted(leaves, close.pairs[pairs])
        events = Events.of(table, members, close.joint[np.ix_(pairs, returns)], close.apart(pairs, returns))
        total = float(kernels.log_sum(events.weight))
        share, names = np.exp(events.weight - total), np.concatenate([[0], 1 + returns])
        found = []
        for row in np.flatnonzero(share > RARER * least).tolist():
            decided = []
            for i, leaf in enumerate(leaves.tolist()):
                choice, pair = int(names[events.taken[row, i]]), int(events.pair[row, i])
                side = int(pair >= 0 and members[pair, 1] == i)
                column = 0 if pair < 0 else scores.k * int(close.columns[pairs[pair], side]) + choice
                # All that the set scores is its first leaf's, so that a hypothesis keeps its weight before the scan.
                decided.append(Leaf(leaf, chosen, choice, column, choice > 0 and side == 0, total if i == 0 else 0.0))
            found.append((float(share[row]), decided))
        return found


def _joined(hypotheses: Hypotheses, close: Close, most: int, least: float) -> Iterator[Held]:
    """Yield weights and leaves of the hypotheses of each cluster; those of clusters with close leaves are multiplied."""
    count = int(hypotheses.cluster.max(initial=-1)) + 1
    every: list[Held] = [[] for _ in range(count)]
    edges = zip(hypotheses.starts.tolist(), hypotheses.starts[1:].tolist(), strict=False)
    for number, weight, (i, j) in zip(hypotheses.cluster.tolist(), hypotheses.weights.tolist(), edges, strict=True):
        every[number].append((weight, tuple(hypotheses.leaves[i:j].tolist())))
    usable = np.isfinite(close.joint).any(axis=1)
    linked = hypotheses.cluster_of[close.pairs[usable]]
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


def _scores_of(every: list[Leaf], scores: LeafScores) -> LeafScores:
    """Return the log scores of leaves of which some have decided."""
    starts = np.concatenate([[0], scores.ends])
    miss, number, returns, gains = list[float](), list[int](), list[Indices](), list[Array]()
    for leaf in every:
        own = slice(int(starts[leaf.row]), int(starts[leaf.row + 1]))
        taken, gain = scores.returns[own], scores.scores[own]
        if leaf.pairs:
            taken, gain = np.arange(leaf.choice - 1, leaf.choice)[: leaf.takes], np.full(int(leaf.takes), leaf.score)
        miss.append((-np.inf if leaf.takes else leaf.score) if leaf.pairs else float(scores.miss[leaf.row]))
        number.append(len(taken))
        returns.append(taken)
        gains.append(gain)
    taken, gain = np.concatenate([NO_RETURNS, *returns]), np.concatenate([[], *gains])
    return LeafScores(np.array(miss), np.cumsum(number), taken, gain, scores.k)


def _contracted(grown: Branching, every: list[Leaf], real: Indices) -> Branching:
    """Return the branching of the leaves that there were, those that decided alike being one."""
    after, begun = grown.hypotheses, grown.parent < 0
    decided = np.array([(len(one.pairs) > 0, one.choice, one.column) for one in every], dtype=np.int64).reshape(-1, 3)
    own = decided[grown.parent]
    choice = np.where(begun | (own[:, 0] == 0), grown.choice, own[:, 1])
    merged = np.where(begun, 0, own[:, 2])
    parent = np.where(begun, len(every), real[grown.parent])
    _, first, row = np.unique(np.stack([parent, choice, merged]), axis=1, return_index=True, return_inverse=True)
    leaves = row.ravel()[after.leaves]
    order = np.lexsort((leaves, after.rows))
    past = after.past[first]
    if past.shape[1]:
        past[:, 0] = np.where(begun, -1, real[grown.parent])[first]
    hypotheses = Hypotheses(after.cluster, after.weights, after.starts, leaves[order], after.track[first], past)
    lost = None if grown.lost is None else grown.lost[first]
    return Branching(np.where(begun, -1, parent)[first], choice[first], hypotheses, lost, merged=merged[first])
