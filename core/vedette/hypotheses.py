"""The role of associators that keep hypotheses, joint associations of many scans, and the hypotheses of clusters.

Shapes and rules are those of `vedette.roles`; `l` leaves, `h` hypotheses.
"""

from __future__ import annotations

from abc import abstractmethod
from functools import cached_property
from typing import Any, ClassVar, Literal, Self

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.roles import Associator
from vedette.space import Array, Indices, Mask, Space
from vedette.types import Gaussian

MOST_AT_ONCE = 500_000
"""Pairs of leaves of one hypothesis, or of a leaf and a return, looked at together: they take some 60 bytes each."""
ROUNDING = 1e-12
"""Tracks are independent if they are but for rounding, however little a kind may change hypotheses."""

LOST = 1e-3
"""The probability of a cluster's associations from which on their truncation counts as an approximation of its tracks. It is
ten times that below which the standard kinds drop a hypothesis, so that this alone does not count.
"""

MIXED = np.array([0x9E3779B97F4A7C15, 0xBF58476D1CE4E5B9, 0x94D049BB133111EB], dtype=np.uint64).view(np.int64)
"""Odd numbers by which the numbers of three returns are mixed into one that no other three have."""


@frozen(eq=False)
class LeafScores:
    """Log scores of leaves: `miss` (l,), and `scores` (p,) of the `returns` (p,) in their gates, which end at `ends` (l,).

    A leaf's returns ascend; k is their number in the scan.
    """

    miss: Array
    ends: Indices
    returns: Indices
    scores: Array
    k: int

    @classmethod
    def of(cls, table: Array) -> Self:
        """Return those of a table (l, 1+k), column 0 the miss, -inf outside the gate."""
        inside = np.isfinite(table[:, 1:])
        leaf, returns = np.nonzero(inside)
        ends = np.cumsum(np.count_nonzero(inside, axis=-1))
        return cls(np.ascontiguousarray(table[:, 0]), ends, returns, table[leaf, 1 + returns], table.shape[-1] - 1)

    @property
    def leaf(self) -> Indices:
        """The leaf (p,) of each return."""
        return np.repeat(np.arange(len(self.ends)), np.diff(self.ends, prepend=0))


@frozen(eq=False)
class Branching:
    """The leaves of tracks after a scan, those that continue others first, and the hypotheses over them.

    parent (l,): the row of the leaf that it continues, -1 where a track begins; choice (l,): the return that it takes,
    counted from 1, or 0 for a miss. lost (l,): the probability that truncation dropped in the cluster of the leaf;
    None: no more than `LOST` in any. inexact (l,): whether the weights of the leaf's track are approximations, other than by
    truncation; None: none are. merged (l,): of a leaf that gives its return with a leaf of another track, the column,
    from 1, of that in the meeting of close rows; 0 of others, None: there are none.
    """

    parent: Indices
    choice: Indices
    hypotheses: Any
    lost: Array | None = None
    inexact: Mask | None = None
    merged: Indices | None = None

    @property
    def alone(self) -> Mask:
        """Whether each leaf (l,) took a return that no other gives, too."""
        return self.choice > 0 if self.merged is None else (self.choice > 0) & (self.merged == 0)


@frozen(eq=False)
class Merging:
    """Leaves merged into fewer: each new one is a mixture of old ones, by shares (p,) of the old `leaf` (p,) in the new one
    of row `into` (p,), which ascends. It stays of the same track and with the same past as the old one of row `own` (s,).

    The hypotheses are over the new ones.
    """

    own: Indices
    into: Indices
    leaf: Indices
    shares: Array
    hypotheses: Any

    def table(self, count: int) -> Array:
        """Return the shares (s, l) of all `count` leaves."""
        table = np.zeros((len(self.own), count))
        np.add.at(table, (self.into, self.leaf), self.shares)
        return table


@frozen(eq=False)
class JointHypotheses:
    """Hypotheses of clusters: sets of tracks whose associations depend on each other, and on those of no other set.

    cluster (h,): of each hypothesis, ascending from 0; weights (h,): they sum to 1 in a cluster, heaviest first; starts
    (h+1,): where in `leaves` (m,) those of a hypothesis begin, ascending rows, at most one leaf of a track. track (l,): of
    each leaf, ascending from 0 without gaps. past (l, n): rows of each leaf's ancestors
    in n scans before, those that a kind keeps; -1 where its track had not begun.
    """

    cluster: Indices
    weights: Array
    starts: Indices
    leaves: Indices
    track: Indices
    past: Indices

    @classmethod
    def of(cls, tracks: int, scans: int = 0) -> Self:
        """Return those of tracks that are surely there, each a cluster of one leaf, with a past of so many scans."""
        number = np.arange(tracks)
        return cls(number, np.ones(tracks), np.arange(tracks + 1), number, number, np.full((tracks, scans), -1))

    @cached_property
    def rows(self) -> Indices:
        """The hypothesis (m,) that holds each of `leaves`."""
        return np.repeat(np.arange(len(self.weights)), self.starts[1:] - self.starts[:-1])

    @property
    def heaviest(self) -> Indices:
        """The leaves of each cluster's heaviest hypothesis, ascending."""
        return np.sort(self.leaves[firsts(self.cluster)[self.rows]])

    @cached_property
    def probability(self) -> Array:
        """The probability of each leaf (l,): the weight of the hypotheses that hold it."""
        return np.bincount(self.leaves, self.weights[self.rows], len(self.track)).astype(float)

    @property
    def cluster_of(self) -> Indices:
        """The cluster (l,) of each leaf."""
        cluster = np.zeros(len(self.track), dtype=np.int64)
        cluster[self.leaves] = self.cluster[self.rows]
        return cluster

    def grown(self, scores: LeafScores, begins: Mask, most: int, least: float) -> Branching:
        """Return the leaves after a scan, each with the past of the one before it, and the best associations of its returns.

        Clusters whose leaves share a return are joined. At most `most` hypotheses of a cluster are kept, above `least`.
        """
        cluster, weights, starts, leaves, code, lost = kernels.grow(
            self.cluster, self.weights, self.starts, self.leaves, scores.miss, scores.ends, scores.returns, scores.scores,
            begins, most, least,
        )  # fmt: skip
        columns = 1 + scores.k
        parent, choice = np.divmod(code, columns)
        old = parent < len(self.track)
        track = np.concatenate([self.track[parent[old]], len(self.track) + np.arange(np.count_nonzero(~old))])
        parent = np.where(old, parent, -1)
        past = np.full((len(parent), self.past.shape[1]), -1)
        past[old] = self.past[parent[old]]
        after = JointHypotheses(cluster, weights, starts, leaves, _dense(track), past)
        return Branching(parent, choice, after, lost[after.cluster_of] if np.max(lost, initial=0.0) > LOST else None)

    def kept(self, alive: Mask, tolerance: float) -> tuple[JointHypotheses, Indices]:
        """Return the hypotheses without the leaves that ended, and the rows of those that stay.

        Equal hypotheses are merged. A cluster is split into parts whose product changes the weights of its hypotheses by no
        more than `tolerance` in total variation.
        """
        tolerance = max(tolerance, ROUNDING)
        cluster, weights, starts, leaves, rows = kernels.shed(
            self.cluster, self.weights, self.starts, self.leaves, self.track, alive, tolerance
        )
        return JointHypotheses(cluster, weights, starts, leaves, _dense(self.track[rows]), self.past[rows]), rows

    def existence(self, own: Array, last: Indices) -> Array:
        """Return the existence (l,) of the target of each leaf, by the leaves' own (l,), over all hypotheses of its cluster.

        It is that of the leaf's track; and in a hypothesis without that track, that of one which took the same returns last:
        `last` (l, n) numbers these. So a target surely exists of which it is only doubtful which track it is.
        """
        names = last @ MIXED[: last.shape[-1]]
        return kernels.target_existence(self.weights, self.starts, self.leaves, self.track, own, names)


class HypothesisAssociator(Associator):
    """An associator that keeps joint associations of many scans, the hypotheses, instead of the marginals of each scan.

    A track is then a tree: each leaf is the track under one history of associations, with a belief, an existence probability
    and a lifecycle's memory of its own, and a hypothesis chooses at most one leaf of each track. The tracker does the
    filtering, leaf by leaf, with any estimator; this role says which leaves there are. Targets that share no return are
    independent, so hypotheses are those of clusters of tracks: `JointHypotheses` joins and splits them. A kind may keep
    anything else, attrs values, tuples and arrays; leaves are numbered by rows. `associate` gives the marginals of one scan.

    Laws: every leaf is in some hypothesis. No two leaves of a hypothesis take the same return. Probabilities are those
    of the joint association: they sum to 1 over the hypotheses of a cluster. What is far away changes nothing.
    """

    by_cluster: ClassVar[bool] = True
    exclusive: ClassVar[bool] = True

    shows_marginals: ClassVar[bool] = False
    """Whether a leaf is shown with the existence of its target over all leaves, and not under its own history."""

    unlikelier: ClassVar[float] = 0.75
    """Associations that were dropped hold a link of those that were kept so much more rarely. Chosen, for truncation, on
    runs 0 to 7 of `benchmarks.horizons`.
    """

    @property
    def merges(self) -> Literal["", "kept", "shown"]:
        """Which leaves are merged after each scan, if beliefs can be: none, those kept or those shown."""
        return ""

    @abstractmethod
    def initial_hypotheses(self, tracks: int) -> Any:
        """Return the hypotheses before the first scan: every given track is there, in one leaf each."""

    @abstractmethod
    def branch(self, hypotheses: Any, scores: LeafScores, begins: Mask) -> Branching:
        """Return the leaves after a scan, from the log scores of the leaves before it.

        begins (k,): whether a track begins at a return, in the hypotheses in which no other track takes it.
        """

    def branch_close(self, hypotheses: Any, scores: LeafScores, begins: Mask, close: Any) -> Branching:
        """Return what `branch` does where leaves may give one return with another, by the `close` of `meet_close`."""
        raise NotImplementedError(f"{self.kind!r} takes no merged returns")

    def merge(self, hypotheses: Any, estimate: Gaussian, existence: Array, state: Space) -> Merging:
        """Return how the leaves are merged, from their estimates (l, n) over `state` and existence (l,)."""
        raise NotImplementedError(f"{self.kind!r} merges no leaves")

    @abstractmethod
    def keep(self, hypotheses: Any, alive: Mask) -> tuple[Any, Indices]:
        """Return the hypotheses without the leaves that ended, alive (l,), and the rows of the leaves that stay."""

    @abstractmethod
    def probability(self, hypotheses: Any) -> Array:
        """Return the probability of each leaf (l,): the sum over the hypotheses that hold it."""

    @abstractmethod
    def existence(self, hypotheses: Any, own: Array, last: Indices) -> Array:
        """Return the existence (l,) of each leaf's target over all hypotheses, from the leaves' own (l,).

        The lifecycle judges by it. last (l, n): numbers of the returns that each took last, -1 where it took fewer.
        """

    def shown_with(self, hypotheses: Any, existence: Array, leaves: Indices) -> Indices:
        """Return the rows that would be shown if some leaves were known to be right, those that it rules out left aside.

        So are the tracks found that ended before the last scan, for smoothing. existence (l,): that of each leaf.
        """
        return self.reported(hypotheses, existence)

    @abstractmethod
    def reported(self, hypotheses: Any, existence: Array) -> Indices:
        """Return the rows of the leaves that are shown, at most one of each track, the oldest track first.

        existence (l,): that of each leaf. If a track's leaves are alternatives, its best is that of a target that exists.
        """


def _dense(ascending: Indices) -> Indices:
    """Return numbers that ascend as others from 0 without gaps."""
    return np.cumsum(firsts(ascending)) - 1


def firsts(ascending: Indices) -> Mask:
    """Return whether each number (n,) is the first of its kind."""
    first = np.ones(len(ascending), dtype=bool)
    np.not_equal(ascending[1:], ascending[:-1], out=first[1:])
    return first
