"""The labelled multi-Bernoulli filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Branching, HypothesisAssociator, Indices, Mask, fields, kernels
from vedette.hypotheses import LeafScores
from vedette.tracking import Expected, Meeting
from vedette_standard.associators.marginals import joint_marginals, marginals_of_table
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.meeting import meet_close
from vedette_standard.unresolved.mixtures import Together


@frozen(eq=False)
class Mixtures:
    """The track of each leaf (l,), ascending without gaps from 0, and its weight (l,) within it: what the weights of a track
    lack of 1 is the probability that it never began.
    """

    track: Indices
    weights: Array


@final
@frozen
class LabelledMultiBernoulli(HypothesisAssociator):
    """Keeps each track as a mixture of leaves, and forgets which leaves of different tracks go together.

    The score of a track is that of its mixture. All joint associations of each cluster of tracks that share returns
    give the marginal probability of each return for each track, as in `jpda`, and each leaf branches by each return in its
    gate. Of each track the heaviest leaves are kept. All tracks are shown, each by the leaf that is heaviest given that its
    target exists. Where a cluster is too wide for exact sums, belief propagation takes their place: the best associations
    alone would make what they hold too certain.
    Kropfreiter, Meyer, Hlawatsch, A Fast Labeled Multi-Bernoulli Filter Using Belief Propagation, IEEE T-AES 56, 2020;
    Reuter, Vo, Vo, Dietmayer, The Labeled Multi-Bernoulli Filter, IEEE Trans. Signal Processing 62, 2014.

    >>> from itertools import product
    >>> scores = np.array([[-1.0, 0.5, -0.2], [-0.6, 0.3, 0.8]])
    >>> events = [e for e in product(range(3), repeat=2) if len({*e} - {0}) == np.count_nonzero(e)]  # no return twice
    >>> p = np.exp([sum(scores[range(2), e]) for e in events])
    >>> wanted = np.array([[p @ [e[t] == i for e in events] / np.sum(p) for i in range(3)] for t in range(2)])
    >>> kind = LabelledMultiBernoulli(leaves=2, least=0.01)
    >>> found = kind.branch(kind.initial_hypotheses(2), LeafScores.of(scores), np.array([True, True]))
    >>> found.parent.tolist(), found.choice.tolist()  # all leaves, and a track at each return
    ([0, 0, 0, 1, 1, 1, -1, -1], [0, 1, 2, 0, 1, 2, 1, 2])
    >>> np.allclose(found.hypotheses.weights, [*wanted.ravel(), *(1.0 - np.sum(wanted, axis=0)[1:])])
    True
    >>> np.allclose(kind.associate(scores, None), wanted)
    True
    >>> kept, rows = kind.keep(found.hypotheses, np.ones(8, dtype=bool))  # the two heaviest of a track, of the same sum
    >>> rows.tolist() == sorted([*np.argsort(wanted[0])[1:], *(3 + np.argsort(wanted[1])[1:]), 6, 7])
    True
    >>> np.allclose(np.bincount(kept.track, kept.weights)[:2], 1.0), kind.reported(kept, np.ones(6)).tolist()
    (True, [0, 3, 4, 5])
    >>> np.allclose(kind.existence(kept, np.full(6, 0.5), None)[:4], 0.5)
    True
    """

    kind: ClassVar[str] = "lmb"
    shows_marginals: ClassVar[bool] = True
    takes_merged: ClassVar[bool] = True

    leaves: int = fields.integer("most leaves of a track", default=20, at_least=1)
    least: float = fields.probability("weight in its track at or below which a leaf is dropped", default=1e-4, below=1)
    exact: int = fields.integer(
        "most tracks, or else most returns, that exact sums keep apart at once: each takes twice the time",
        default=14,
        at_most=16,
    )

    @property
    def solves(self) -> str:
        return "marginals" if self.exact >= 4 else ""

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of all joint associations: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return marginals_of_table(scores, self.exact, joint_marginals)[0]

    def initial_hypotheses(self, tracks: int) -> Mixtures:
        """Return one leaf for each given track."""
        return Mixtures(np.arange(tracks), np.ones(tracks))

    def branch(self, hypotheses: Mixtures, scores: LeafScores, begins: Mask) -> Branching:
        return self._branch(hypotheses, scores, begins, None)

    def branch_close(self, hypotheses: Mixtures, scores: LeafScores, begins: Mask, close: Close) -> Branching:
        """Return the leaves after a scan in which leaves may give one return with those of another track."""
        return self._branch(hypotheses, scores, begins, close)

    def meet_close(self, expected: Expected) -> Meeting | None:
        """Return the meeting of leaves that may give one return with one of another track; None: none may."""
        return meet_close(expected, expected.state.leaves.hypotheses.track)

    def _branch(self, hypotheses: Mixtures, scores: LeafScores, begins: Mask, close: Close | None) -> Branching:
        track, weights = hypotheses.track, hypotheses.weights
        count, log_weight, leaf = int(track[-1]) + 1 if len(track) else 0, kernels.safe_log(weights), scores.leaf
        pairs, which = np.unique(track[leaf] * scores.k + scores.returns, return_inverse=True)
        likely, missed = log_weight[leaf] + scores.scores, log_weight + scores.miss
        total = _log_sums(which, likely, len(pairs))
        absent = kernels.safe_log(np.maximum(1.0 - np.bincount(track, weights, count), 0.0))
        miss = np.logaddexp(_log_sums(track, missed, count), absent)
        of, returns = np.divmod(pairs, max(scores.k, 1))
        ends = np.cumsum(np.bincount(of, minlength=count))
        tracks = LeafScores(miss, ends, returns, total, scores.k)
        misses, taken, inexact = joint_marginals(tracks, self.exact)
        both = None if close is None else Together.of(track, log_weight, scores, tracks, close, misses, taken)
        share = np.concatenate([_share(missed, miss[track]) * misses[track], _share(likely, total[which]) * taken[which]])
        parent, choice = (
            np.concatenate([np.arange(len(track)), leaf]),
            np.append(np.zeros(len(track), int), 1 + scores.returns),
        )
        merged, free = np.zeros(len(parent), dtype=np.int64), 1.0 - np.bincount(returns, taken, scores.k)
        if both is not None:
            parent, choice, share = (
                np.append(parent, both.parent),
                np.append(choice, both.choice),
                np.append(share, both.share),
            )
            merged, free = np.append(merged, both.merged), free - both.returns
        some = np.flatnonzero(share > self.least)
        some = some[np.lexsort((merged[some], choice[some], parent[some]))]
        whole = np.bincount(track[parent], share, count)
        parent, choice, share, merged = parent[some], choice[some], share[some], merged[some]
        # What is dropped is other leaves' of the track: what its weights lack of 1 is that it never began.
        share = share * (whole / np.maximum(np.bincount(track[parent], share, count), np.finfo(float).tiny))[track[parent]]
        free = np.maximum(free, 0.0)
        news = np.flatnonzero(begins & (free > self.least))
        return Branching(
            parent=np.concatenate([parent, np.full(len(news), -1)]),
            choice=np.concatenate([choice, 1 + news]),
            hypotheses=Mixtures(
                np.concatenate([track[parent], count + np.arange(len(news))]), np.concatenate([share, free[news]])
            ),
            inexact=np.append(inexact[track[parent]], np.zeros(len(news), dtype=bool)) if inexact.any() else None,
            merged=None if both is None else np.append(merged, np.zeros(len(news), dtype=np.int64)),
        )

    def keep(self, hypotheses: Mixtures, alive: Mask) -> tuple[Mixtures, Indices]:
        """Return the heaviest leaves of each track that goes on."""
        track, weights = hypotheses.track, hypotheses.weights
        order = np.lexsort((-weights, track))
        order = order[alive[order]]
        rank = np.arange(len(order)) - np.searchsorted(track[order], track[order])
        rows = np.sort(order[rank < self.leaves])
        _, left = np.unique(track[rows], return_inverse=True)
        before, after = np.bincount(track[alive], weights[alive]), np.bincount(track[rows], weights[rows], len(track))
        scale = before[track[rows]] / after[track[rows]]
        return Mixtures(left, weights[rows] * scale), rows

    def probability(self, hypotheses: Mixtures) -> Array:
        return hypotheses.weights

    def existence(self, hypotheses: Mixtures, own: Array, last: Indices) -> Array:
        """Return the existence of each leaf's track."""
        total = np.bincount(hypotheses.track, hypotheses.weights * own).astype(float)
        return np.minimum(total, 1.0)[hypotheses.track]

    def reported(self, hypotheses: Mixtures, existence: Array) -> Indices:
        """Return the leaf of each track that is heaviest if its target exists."""
        order = np.lexsort((-hypotheses.weights * existence, hypotheses.track))
        return order[np.unique(hypotheses.track[order], return_index=True)[1]]


def _log_sums(owner: Indices, logs: Array, count: int) -> Array:
    """Return log of the sum of exp(logs) (p,) of each owner."""
    top = np.full(count, -np.inf)
    np.maximum.at(top, owner, logs)
    top = np.where(np.isfinite(top), top, 0.0)
    sums: Array = np.bincount(owner, np.exp(logs - top[owner]), count).astype(float)
    return kernels.safe_log(sums) + top


def _share(logs: Array, total: Array) -> Array:
    """Return exp(logs - total), 0 where a log is -inf."""
    some = np.isfinite(logs)
    return np.where(some, np.exp(np.where(some, logs - np.where(some, total, 0.0), 0.0)), 0.0)
