"""Confirmation by M hits in N looks."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, Review, fields, maker
from vedette_standard.compiled import fastest
from vedette_standard.lifecycles.limited import COVERED, DETECTED, Limited


@frozen(eq=False)
class Looks:
    """hits (*b, t): one bit per look, the latest lowest; looks (*b, t): how many there were; confirmed (*b, t)."""

    hits: Indices
    looks: Indices
    confirmed: Mask


@final
@frozen
class MOfN(Limited):
    """Confirms a track after `hits` detections in its last `looks` looks, and ends it after `misses` looks without one.

    A look is a scan in which the sensor should see the track with a probability of at least `worth`; a detection is a
    probability above 1/2 that a return was the track's. A tentative track ends as soon as `looks` looks have too few hits.
    Bar-Shalom, Li, Multitarget-Multisensor Tracking, 1995, section 3.3.

    >>> from vedette import Review
    >>> life = MOfN(hits=2, looks=3, misses=2, worth=0.3, max_without_detection=8.0)
    >>> memory = life.start(np.full(4, 0.5))
    >>> scans = [([0.9, 0.5, 0.0, 0.6], [0.5, 0.3, 0.5, 0.2]), ([0.0, 0.0, 0.0, 0.0], [0.5, 0.29, 0.5, 0.2])]
    >>> scans += [([0.0, 0.6, 0.0, 0.0], [0.3, 0.1, 0.5, 0.2]), ([0.0, 0.0, 0.0, 0.0], [0.3, 0.3, 0.3, 0.2])]
    >>> for hit, p in scans:
    ...     memory, confirmed, alive = life.review(memory, Review(3.0, np.ones(4), np.array(hit), np.array(p)))
    ...     print(confirmed.tolist(), alive.tolist())
    [True, False, False, True] [True, True, True, True]
    [True, False, False, True] [True, True, False, True]
    [True, True, False, True] [False, True, False, True]
    [True, True, False, True] [False, True, False, False]
    """

    kind: ClassVar[str] = "m_of_n"
    abbreviations: ClassVar[tuple[str, ...]] = ("mofn",)
    certain: ClassVar[bool] = True

    hits: int = fields.integer("M, detections that confirm a track", default=3, at_least=1, at_most=60)
    looks: int = fields.integer("N, looks in which they must fall", default=5, at_least=1, at_most=60)
    misses: int = fields.integer(
        "looks in a row without a detection that end a confirmed track", default=5, at_least=1, at_most=60
    )
    worth: float = fields.probability(
        "least detection probability for a scan to count as a look", default=0.1, tried=(0.01, 0.1, 0.9)
    )

    def __attrs_post_init__(self) -> None:
        if self.hits > self.looks:
            raise ValueError(f"hits: must be <= looks, {self.looks}, got {self.hits}")

    @property
    def least_covered(self) -> float:
        """The detection probability from which on a scan counts as a look."""
        return max(self.worth, COVERED)

    def start_own(self, existence: Array) -> Looks:
        """Return one look and one hit for each track, which confirms it where `hits` is 1."""
        once = np.ones(existence.shape, dtype=np.int64)
        return Looks(once, once, np.full(existence.shape, self.hits == 1))

    def judge(self, own: Looks, scan: Review) -> tuple[Looks, Mask, Mask]:
        """Count the look, confirm and end."""
        hits, looks, confirmed, alive = m_of_n(
            own.hits, own.looks, own.confirmed, scan.hit, scan.p_detect, self.worth, self.hits, self.looks, self.misses
        )
        return new_looks(hits, looks, confirmed), confirmed, alive


new_looks = maker(Looks)


@fastest
def m_of_n(
    hits: Indices, looks: Indices, confirmed: Mask, hit: Array, p_detect: Array, worth: float, m: int, n: int, misses: int
) -> tuple[Indices, Indices, Mask, Mask]:
    """Return hits and looks after a scan, which tracks are confirmed, and which are alive."""
    detected = hit > DETECTED
    looked = detected | (p_detect >= worth)
    hits = np.where(looked, (hits << 1 | detected) & (1 << 60) - 1, hits)
    looks = looks + looked
    recent = np.bitwise_count(hits & (1 << n) - 1)
    confirmed = confirmed | (recent >= m)
    coasting = (hits & (1 << misses) - 1 == 0) & (looks >= misses)
    too_few = looks - recent > n - m
    return hits, looks, confirmed, np.where(confirmed, ~coasting, ~too_few)
