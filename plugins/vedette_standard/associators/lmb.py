"""The labelled multi-Bernoulli filter."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Branching, HypothesisAssociator, Indices, Mask, fields, kernels


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

    The score of a track is that of its mixture. The best joint associations of the scan give the marginal probability of
    each return for each track, and each leaf branches by each return in its gate. The heaviest leaves of each track are
    kept. All tracks are shown, each by the leaf that is heaviest given that its target exists.
    Reuter, Vo, Vo, Dietmayer, The Labeled Multi-Bernoulli Filter, IEEE Trans. Signal Processing 62, 2014.
    """

    kind: ClassVar[str] = "lmb"

    leaves: int = fields.integer("most leaves of a track", default=20, at_least=1)
    least: float = fields.probability("weight in its track at or below which a leaf is dropped", default=1e-4, below=1)
    associations: int = fields.integer(
        "largest number of joint associations of a scan that are computed", default=200, at_least=1
    )

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of the scan's best joint associations: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.best_marginals(scores, self.associations)

    def initial_hypotheses(self, tracks: int) -> Mixtures:
        """Return one leaf for each given track."""
        return Mixtures(np.arange(tracks), np.ones(tracks))

    def branch(self, hypotheses: Mixtures, scores: Array, begins: Mask) -> Branching:
        """Return the leaves after a scan."""
        track, weights = hypotheses.track, hypotheses.weights
        starts = np.flatnonzero(np.diff(track, prepend=-1))
        count, likely = len(starts), kernels.safe_log(weights)[:, None] + scores
        total = np.logaddexp.reduceat(likely, starts, axis=0)
        absent = np.maximum(1.0 - np.bincount(track, weights, count), 0.0)
        total[:, 0] = np.logaddexp(total[:, 0], kernels.safe_log(absent))
        marginals = self.associate(total, None)
        with np.errstate(invalid="ignore"):
            shares = np.where(np.isfinite(likely), np.exp(likely - total[track]), 0.0) * marginals[track]
        parent, choice = np.nonzero(shares > self.least)
        free = np.maximum(1.0 - np.sum(marginals[:, 1:], axis=0), 0.0)
        news = np.flatnonzero(begins & (free > self.least))
        return Branching(
            parent=np.concatenate([parent, np.full(len(news), -1)]),
            choice=np.concatenate([choice, 1 + news]),
            hypotheses=Mixtures(
                np.concatenate([track[parent], count + np.arange(len(news))]),
                np.concatenate([shares[parent, choice], free[news]]),
            ),
        )

    def keep(self, hypotheses: Mixtures, alive: Mask) -> tuple[Mixtures, Indices]:
        """Return the heaviest leaves of each track that goes on."""
        track, weights = hypotheses.track, hypotheses.weights
        order = np.lexsort((-weights, track))
        rank = np.arange(len(order)) - np.searchsorted(track[order], track[order])
        rows = np.sort(order[(rank < self.leaves) & alive[order]])
        _, left = np.unique(track[rows], return_inverse=True)
        before, after = np.bincount(track, weights), np.bincount(track[rows], weights[rows], len(track))
        scale = before[track[rows]] / after[track[rows]]
        return Mixtures(left, weights[rows] * scale), rows

    def probability(self, hypotheses: Mixtures) -> Array:
        """Return the probability of each leaf."""
        return hypotheses.weights

    def judged(self, hypotheses: Mixtures, existence: Array) -> Array:
        """Return the existence of each leaf's track."""
        total = np.bincount(hypotheses.track, hypotheses.weights * existence).astype(float)
        judged: Array = np.minimum(total, 1.0)[hypotheses.track]
        return judged

    def reported(self, hypotheses: Mixtures, existence: Array) -> Indices:
        """Return the leaf of each track that is heaviest if its target exists."""
        order = np.lexsort((-hypotheses.weights * existence, hypotheses.track))
        return order[np.unique(hypotheses.track[order], return_index=True)[1]]
