"""The common part of associators that grow the best joint associations of a scan from hypotheses that they keep."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from attrs import evolve

from vedette import Array, Branching, Gaussian, HypothesisAssociator, Indices, Mask, Merging, Space
from vedette.hypotheses import LOST, JointHypotheses, LeafScores, firsts
from vedette.tracking import Expected, Meeting
from vedette_standard.associators.marginals import marginals_of_table
from vedette_standard.associators.parting import grown_apart
from vedette_standard.associators.recombined import merged_by_track
from vedette_standard.lifecycles.limited import UNSEEN
from vedette_standard.unresolved.close import Close
from vedette_standard.unresolved.growth import grown_close
from vedette_standard.unresolved.meeting import of_hypotheses


class Growing(HypothesisAssociator):
    """Keeps at most `hypotheses` of each cluster; those of a weight up to `least` are dropped."""

    takes_merged: ClassVar[bool] = True

    hypotheses: int
    least: float

    @property
    def past(self) -> int:
        """Of how many scans that could see its track the ancestors of each leaf are kept."""
        return 0

    def associate(self, scores: Array, evidence: Array | None) -> Array:
        """Return the marginals of the best associations of each cluster: (*b, t, 1+k) -> (*b, t, 1+k)."""
        return marginals_of_table(scores, self.hypotheses)[0]

    def initial_hypotheses(self, tracks: int) -> JointHypotheses:
        """Return the hypotheses in which every given track is there, each a cluster of its own."""
        return JointHypotheses.of(tracks, self.past)

    def branch(self, hypotheses: JointHypotheses, scores: LeafScores, begins: Mask) -> Branching:
        """Return the leaves and hypotheses after a scan."""
        return self._deciding(hypotheses, scores, grown_apart(hypotheses, scores, begins, self.hypotheses, self.least))

    def _deciding(self, before: JointHypotheses, scores: LeafScores, after: Branching) -> Branching:
        """Return the same, with a scan more of the past, and with what `keep` will drop told as lost."""
        if not self.past:
            return after
        after = evolve(after, hypotheses=_remembered(before, scores, after))
        # What `keep` decides is told with what is dropped here.
        found = after.hypotheses
        dropped = 1.0 - np.bincount(found.cluster, found.weights * _agreeing(found))[found.cluster_of]
        lost = dropped if after.lost is None else 1.0 - (1.0 - after.lost) * (1.0 - dropped)
        return evolve(after, lost=lost if np.max(lost, initial=0.0) > LOST else None)

    def meet_close(self, expected: Expected) -> Meeting | None:
        """Return the meeting of leaves that may give one return with another one; None: none may."""
        return of_hypotheses(expected, expected.state.leaves.hypotheses)

    def branch_close(self, hypotheses: JointHypotheses, scores: LeafScores, begins: Mask, close: Close) -> Branching:
        """Return the leaves and hypotheses after a scan in which leaves may give one return with others."""
        after = grown_close(hypotheses, scores, begins, close, self.hypotheses, self.least)
        return self._deciding(hypotheses, scores, after)

    def merge(self, hypotheses: JointHypotheses, estimate: Gaussian, existence: Array, state: Space) -> Merging:
        """Return the leaves merged into one for each track, of a past that the heaviest association of the track has."""
        return merged_by_track(hypotheses, estimate, existence, state)

    def keep(self, hypotheses: JointHypotheses, alive: Mask) -> tuple[JointHypotheses, Indices]:
        """Return the hypotheses without the leaves that ended, and of those that past decisions rule out."""
        return (_decided(hypotheses) if self.past else hypotheses).kept(alive, self.least)

    def probability(self, hypotheses: JointHypotheses) -> Array:
        return hypotheses.probability

    def existence(self, hypotheses: JointHypotheses, own: Array, last: Indices) -> Array:
        return hypotheses.existence(own, last)

    def shown_with(self, hypotheses: JointHypotheses, existence: Array, leaves: Indices) -> Indices:
        """Return the leaves of the heaviest hypothesis of each cluster that holds most of some of its leaves."""
        return _holding(hypotheses, leaves)

    def reported(self, hypotheses: JointHypotheses, existence: Array) -> Indices:
        """Return the leaves of the heaviest hypothesis of each cluster."""
        return hypotheses.heaviest


def _holding(found: JointHypotheses, leaves: Indices) -> Indices:
    """Return the leaves, ascending, of the heaviest hypothesis of each cluster that holds most of some of its leaves."""
    held = np.zeros(len(found.track), dtype=bool)
    held[leaves] = True
    number = np.bincount(found.rows, held[found.leaves], len(found.weights))
    order = np.lexsort((-number, found.cluster))
    best = np.zeros(len(found.weights), dtype=bool)
    best[order[firsts(found.cluster)]] = True
    return np.sort(found.leaves[best[found.rows]])


def _remembered(before: JointHypotheses, scores: LeafScores, after: Branching) -> JointHypotheses:
    """Return the hypotheses after a scan, with its leaves in the past of those tracks that it could see."""
    found, old = after.hypotheses, after.parent >= 0
    looked = (scores.miss < -UNSEEN) | (np.diff(scores.ends, prepend=0) > 0)
    seen = np.zeros(len(old), dtype=bool)
    seen[old] = (np.bincount(before.track, looked) > 0)[before.track[after.parent[old]]]
    past = found.past.copy()
    past[seen, 1:], past[seen, 0] = found.past[seen, :-1], after.parent[seen]
    return evolve(found, past=past)


def _agreeing(found: JointHypotheses) -> Mask:
    """Return which hypotheses (h,) hold of each track a leaf with the oldest ancestor which their cluster's heaviest has."""
    oldest = found.past[:, -1]
    named = found.track * (1 + np.max(oldest, initial=0)) + oldest  # ancestors of two tracks may be of other scans
    ancestor = np.where(oldest < 0, -1, np.unique(named, return_inverse=True)[1])[found.leaves]
    begun, rows = ancestor >= 0, found.rows
    best = firsts(found.cluster)
    settled = np.zeros(int(np.max(ancestor, initial=-1)) + 1, dtype=bool)
    settled[ancestor[begun & best[rows]]] = True
    count = len(found.weights)
    number = np.bincount(rows[begun], minlength=count)
    agreeing = np.bincount(rows[begun], settled[ancestor[begun]], count)
    return (number == agreeing) & (number == number[best][found.cluster])


def _decided(found: JointHypotheses) -> JointHypotheses:
    """Return the hypotheses that agree on the oldest ancestors, which are then forgotten: nothing is decided twice."""
    agrees, past = _agreeing(found), found.past.copy()
    past[:, -1] = -1
    weights = found.weights[agrees]
    weights = weights / np.bincount(found.cluster[agrees], weights)[found.cluster[agrees]]
    starts = np.concatenate([[0], np.cumsum(np.diff(found.starts)[agrees])])
    leaves = found.leaves[agrees[found.rows]]
    return evolve(found, cluster=found.cluster[agrees], weights=weights, starts=starts, leaves=leaves, past=past)
