"""The leaves of tracks where hypotheses are kept: what a state holds of each."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from attrs import frozen

from vedette.hypotheses import MIXED, HypothesisAssociator
from vedette.sampling.seeds import NotInLockStep
from vedette.space import Array, Indices, Mask
from vedette.tracking.identity import Names


@frozen(eq=False)
class Ended:
    """Leaves (e,) that ended in a scan: their tracks, rows after the scan before, existence, and probability."""

    ids: Indices
    parent: Indices
    existence: Array
    probability: Array


NONE_ENDED = Ended(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0))


@frozen(eq=False)
class Leaves:
    """The leaves of all tracks after a scan, one a row; those that are reported are the tracks of the `State`.

    belief, memory and hypotheses are the estimator's, the lifecycle's and the associator's. ids (l,): the track that a leaf
    belongs to; parent (l,): its row after the scan before, -1 where it began; choice (l,): the return that it took, counted
    from 1, or 0 for a miss; distance (l,): the squared distance of that; last (l, 3): numbers of the returns that it took
    last, -1 for none. shown (t,): the rows of the state's tracks; there (l,): the probability that a leaf is right and its
    target exists, less where links were dropped. lost (l,): the probability that truncation dropped in the scan, of all
    associations of the leaf's cluster; None: next to none. sure (l, 2): where leaves are
    merged, the share of those that took the return taken last, and the one before; None where they are not. ended: leaves
    that are no more. names: the codes that leaves bear; None where no return named its object.
    """

    belief: Any
    memory: Any
    hypotheses: Any
    ids: Indices
    existence: Array
    confirmed: Mask
    parent: Indices
    choice: Indices
    distance: Array
    last: Indices
    shown: Indices
    there: Array
    lost: Array | None = None
    sure: Array | None = None
    ended: Ended = NONE_ENDED
    names: Names | None = None

    @cached_property
    def links(self) -> Array:
        """The probability (t,) that the return which a shown leaf took and its last before are of one target.

        It is the sum over all leaves that took both, of `there`. NaN where it took no return, or none before.
        """
        rows, there = self.shown, self.there
        links = np.full(len(rows), np.nan)
        asked = (self.choice[rows] > 0) & (self.last[rows, 1] != -1)
        if not asked.any():
            return links
        if self.sure is not None:
            there = there * self.sure[:, 0] * self.sure[:, 1]
        code = self.last[:, 1] * MIXED[0] + self.last[:, 2] * MIXED[1]
        wanted, of = np.unique(code[rows[asked]], return_inverse=True)
        at = np.minimum(np.searchsorted(wanted, code), len(wanted) - 1)
        same = (wanted[at] == code) & (self.choice > 0)
        links[asked] = np.minimum(np.bincount(at[same], there[same], len(wanted))[of], 1.0)
        return links


def initial_leaves(associator: HypothesisAssociator, belief: Any, memory: Any, shape: tuple[int, ...]) -> Leaves:
    """Return one leaf for each track that is there before the first scan."""
    if len(shape) > 1:
        raise NotInLockStep(f"associator: {associator.kind!r} keeps hypotheses, so runs go one by one")
    count = shape[0]
    hypotheses, sure = associator.initial_hypotheses(count), np.ones(count)
    return Leaves(
        belief, memory, hypotheses, np.arange(count), sure, sure > 0, np.full(count, -1), np.zeros(count, dtype=np.int64),
        np.zeros(count), np.column_stack([np.full((count, 2), -1), -2 - np.arange(count)]), np.arange(count), sure,
    )  # fmt: skip


def linked(associator: HypothesisAssociator, there: Array, lost: Array | None) -> Array:
    """Return the probability (l,) that leaves are right and their targets exist, less by what was dropped of their links."""
    return there if lost is None else there * (1.0 - associator.unlikelier * lost)
