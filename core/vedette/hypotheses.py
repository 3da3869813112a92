"""The role of associators that keep hypotheses: joint associations of many scans.

Shapes and rules are those of `vedette.roles`; `l` leaves.
"""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar, Literal

from attrs import frozen

from vedette.roles import Associator
from vedette.space import Array, Indices, Mask, Space
from vedette.types import Gaussian


@frozen(eq=False)
class Branching:
    """The leaves of tracks after a scan, those that continue others first, and the hypotheses over them.

    parent (l,): the row of the leaf that it continues, -1 where a track begins; choice (l,): the return that it takes,
    counted from 1, or 0 for a miss.
    """

    parent: Indices
    choice: Indices
    hypotheses: Any


@frozen(eq=False)
class Merging:
    """Leaves merged into fewer: each new one (s,) is the mixture of old ones in the `shares` (s, l), and stays of the same
    track and with the same past as the old one of row `own` (s,). The hypotheses are over the new ones.
    """

    own: Indices
    shares: Array
    hypotheses: Any


class HypothesisAssociator(Associator):
    """An associator that keeps joint associations of many scans, the hypotheses, instead of the marginals of each scan.

    A track is then a tree: each leaf is the track under one history of associations, with a belief, an existence probability
    and a lifecycle's memory of its own, and a hypothesis chooses at most one leaf of each track. The tracker does the
    filtering, leaf by leaf, with any estimator; this role says which leaves there are. `hypotheses` is whatever the kind
    keeps, attrs values, tuples and arrays; leaves are numbered by rows. `associate` gives the marginals of one scan alone.

    Laws: every leaf is in some hypothesis. No two leaves of a hypothesis take the same return. Probabilities are those
    of the joint association: they sum to 1 over the hypotheses.
    """

    exclusive: ClassVar[bool] = True

    @property
    def merges(self) -> Literal["", "kept", "shown"]:
        """Which leaves are merged after each scan, if beliefs are Gaussian: none, those kept or those shown."""
        return ""

    @abstractmethod
    def initial_hypotheses(self, tracks: int) -> Any:
        """Return the hypotheses before the first scan: every given track is there, in one leaf each."""

    @abstractmethod
    def branch(self, hypotheses: Any, scores: Array, begins: Mask) -> Branching:
        """Return the leaves after a scan, from log scores (l, 1+k) of the leaves before it, column 0 the miss.

        begins (k,): whether a track begins at a return, in the hypotheses in which no other track takes it.
        """

    def merge(self, hypotheses: Any, estimate: Gaussian, existence: Array, state: Space) -> Merging:
        """Return how the leaves are merged, from their estimates (l, n) over `state` and existence (l,)."""
        raise NotImplementedError(f"{self.kind!r} merges no leaves")

    @abstractmethod
    def keep(self, hypotheses: Any, alive: Mask) -> tuple[Any, Indices]:
        """Return the hypotheses without the leaves that ended, alive (l,), and the rows of the leaves that stay."""

    @abstractmethod
    def probability(self, hypotheses: Any) -> Array:
        """Return the probability of each leaf (l,): the sum over the hypotheses that hold it."""

    def judged(self, hypotheses: Any, existence: Array) -> Array:
        """Return the existence (l,) by which the lifecycle judges each leaf and the estimate shows it, from its own (l,)."""
        return existence

    @abstractmethod
    def reported(self, hypotheses: Any, existence: Array) -> Indices:
        """Return the rows of the leaves that are shown, at most one of each track, the oldest track first.

        existence (l,): that of each leaf. If a track's leaves are alternatives, its best is that of a target that exists.
        """
