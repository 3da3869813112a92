"""Initiation, confirmation and deletion by the probability that the target exists."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Mask, Review, fields, maker
from vedette_standard.compiled import fastest
from vedette_standard.lifecycles.limited import DETECTED, UNSEEN, Limited


@frozen(eq=False)
class Known:
    """Whether each track was ever confirmed, and the existence below which it ends, all (*b, t)."""

    confirmed: Mask
    least: Array


@final
@frozen
class Existence(Limited):
    """A track as in integrated probabilistic data association: it exists with probability e, updated by every scan.

    Between scans e <- e exp(-dt / lifetime); after one, e <- e L / (1 - e + e L), L the scan's likelihood ratio with the
    track against without it (the tracker does this, for every associator). A track is confirmed once a look at it leaves
    e at `confirm`, stays so as long as e is at least `show`, and ends when e falls below `delete`; one that began below and
    was never above, when e has fallen by a factor of 2.718. A scan that cannot see it ends it by `max_out_of_coverage` only.
    Musicki, Evans, Stankovic, Integrated Probabilistic Data Association, IEEE Trans. Automatic Control 39, 1994.

    >>> from vedette import Review
    >>> life = Existence(lifetime=100.0, confirm=0.9, delete=0.2, show=0.6, max_spread=30.0)
    >>> np.allclose(life.predict(np.array([0.8, 1.0]), 25.0), np.exp([-0.25 + np.log(0.8), -0.25])), life.least_existence
    (True, 0.2)
    >>> memory, none, spread = life.start(np.array([0.95, 0.2, 0.3, 0.3])), np.zeros(4), np.array([30.0, 30.0, 30.0, 31.0])
    >>> for existence in ([0.9, 0.89, 0.5, 0.5], [0.59, 0.89, 0.2, 0.5], [0.6, 0.9, 0.19, 0.5]):
    ...     memory, confirmed, alive = life.review(memory, Review(2.0, np.array(existence), none, none + 0.5, spread))
    ...     print(confirmed.tolist(), alive.tolist())
    [True, False, False, False] [True, True, True, False]
    [False, False, False, False] [True, True, True, False]
    [True, True, False, False] [True, True, False, False]
    """

    kind: ClassVar[str] = "existence"
    abbreviations: ClassVar[tuple[str, ...]] = ("ipda",)

    lifetime: float = fields.quantity("s", "mean time for which a target stays in view", default=600.0, above=0)
    confirm: float = fields.probability("existence that confirms a track", default=0.95)
    delete: float = fields.probability("existence that ends a track", default=0.05, tried=(0.05, 1e-3, 0.3))
    show: float = fields.probability(
        "existence below which a confirmed track is not confirmed for now; default: it stays so", default=0.0
    )

    def __attrs_post_init__(self) -> None:
        if not self.delete < self.confirm:
            raise ValueError(f"confirm: must be > delete, {self.delete:g}, got {self.confirm:g}")

    @property
    def least_existence(self) -> float:
        """Return `delete`."""
        return self.delete

    def start_own(self, existence: Array) -> Known:
        """Return that no track is confirmed, and what ends it as long as it was never above `delete`."""
        least = np.where(existence >= self.delete, self.delete, existence / math.e)
        return Known(np.zeros(existence.shape, dtype=bool), least)

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the existence `dt` s later: (*b, t) -> (*b, t)."""
        return existence * math.exp(-dt / self.lifetime)

    def judge(self, own: Known, scan: Review) -> tuple[Known, Mask, Mask]:
        """Compare the existence with the thresholds, and keep whether a track was ever confirmed."""
        ever, confirmed, alive = by_existence(own.confirmed, scan.existence, self.confirm, self.show, self.delete)
        looked, least = (scan.p_detect > UNSEEN) | (scan.hit > DETECTED), own.least
        if not looked.all():  # what began above `confirm` is confirmed by a look at it, not by a scan of another place
            ever = own.confirmed | ever & looked
            confirmed = confirmed & ever
        if np.any(least < self.delete):
            least = np.where(scan.existence >= self.delete, self.delete, least)
            alive = scan.existence >= least
        return new_known(ever, least), confirmed, alive | self.unseen(scan)


new_known = maker(Known)


@fastest
def by_existence(confirmed: Mask, existence: Array, confirm: float, show: float, delete: float) -> tuple[Mask, Mask, Mask]:
    """Return whether tracks were ever confirmed, whether they are now, and whether they are alive."""
    confirmed = confirmed | (existence >= confirm)
    return confirmed, confirmed & (existence >= show), existence >= delete
