"""Track-oriented multiple hypothesis tracking."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Branching, HypothesisAssociator, Indices, Mask, fields, kernels
from vedette_standard.associators.hypotheses import GlobalHypotheses, branched, heaviest, kept, leaf_probability


@frozen(eq=False)
class Window:
    """The hypotheses, and the rows (l, n) of each leaf's ancestors 1 to n scans ago, -1 where its track had not begun."""

    hypotheses: GlobalHypotheses
    past: Indices


@final
@frozen
class NScan(HypothesisAssociator):
    """Keeps the best joint associations of all scans, and decides those of `scans` scans ago: multiple hypothesis tracking.

    Tracks are trees of leaves. The best hypotheses are found as in `k_best`. In each tree only those leaves remain that
    descend from the leaf which the best hypothesis had `scans` scans ago; hypotheses with other leaves are dropped.
    Blackman, Multiple Hypothesis Tracking for Multiple Target Tracking, IEEE Aerospace and Electronic Systems Magazine 19,
    2004.
    """

    kind: ClassVar[str] = "n_scan"
    abbreviations: ClassVar[tuple[str, ...]] = ("mht", "tomht")

    scans: int = fields.integer("number of scans after which an association is final", default=3, at_least=1)
    hypotheses: int = fields.integer("most hypotheses that are kept", default=100, at_least=1)
    least: float = fields.probability("weight at or below which a hypothesis is dropped", default=1e-4, below=1)

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of the scan's best associations: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return kernels.best_marginals(scores, self.hypotheses)

    def initial_hypotheses(self, tracks: int) -> Window:
        """Return the one hypothesis that holds every given track."""
        return Window(GlobalHypotheses.of(tracks), np.full((tracks, self.scans), -1))

    def branch(self, hypotheses: Window, scores: Array, begins: Mask) -> Branching:
        """Return the leaves and hypotheses after a scan."""
        after = branched(hypotheses.hypotheses, scores, begins, self.hypotheses, self.least)
        past = np.full((len(after.parent), self.scans), -1)
        old = after.parent >= 0
        past[:, 0] = after.parent
        past[old, 1:] = hypotheses.past[after.parent[old], :-1]
        return evolve(after, hypotheses=Window(after.hypotheses, past))

    def keep(self, hypotheses: Window, alive: Mask) -> tuple[Window, Indices]:
        """Return the hypotheses without the leaves that ended and those that what is decided now rules out."""
        leaves, weights = hypotheses.hypotheses.leaves, hypotheses.hypotheses.weights
        held = np.where(leaves >= 0, hypotheses.past[leaves, -1], -2)
        decided = np.max(held, axis=0) >= 0
        agrees = ((held == held[0]) | ~decided).all(axis=1)
        left = GlobalHypotheses(weights[agrees] / np.sum(weights[agrees]), leaves[agrees])
        left, rows = kept(left, alive)
        return Window(left, hypotheses.past[rows]), rows

    def probability(self, hypotheses: Window) -> Array:
        """Return the probability of each leaf."""
        return leaf_probability(hypotheses.hypotheses)

    def reported(self, hypotheses: Window, existence: Array) -> Indices:
        """Return the leaves of the heaviest hypothesis."""
        return heaviest(hypotheses.hypotheses)
