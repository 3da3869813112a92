"""Deletion of tracks that coast for too long."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, Review, fields
from vedette_standard.lifecycles.limited import DETECTED, Limited


@frozen(eq=False)
class Coasting:
    """hits (*b, t): detections so far; missed (*b, t): detections expected since the last; confirmed (*b, t)."""

    hits: Indices
    missed: Array
    confirmed: Mask


@final
@frozen
class CoastLimited(Limited):
    """Confirms a track after `hits` detections, and ends it when it coasts: when too many expected detections are missing.

    The number expected since the last detection is the sum of the detection probabilities of the scans since, so a sensor
    that sees a track badly, or not at all, does not end it. For a tentative track it is compared with `tentative`, for a
    confirmed one with `confirmed`. A detection is a probability above 1/2 that a return was the track's.
    Blackman, Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.2.

    >>> from vedette import Review
    >>> life = CoastLimited(hits=2, tentative=0.8, confirmed=1.6, max_out_of_coverage=5.0)
    >>> memory = life.start(np.full(4, 0.5))
    >>> scans = [([0.6, 0.0, 0.5, 0.9], [0.7, 0.7, 0.7, 0.7]), ([0.0, 0.0, 0.0, 0.0], [0.9, 0.05, 0.2, 0.001])]
    >>> scans += [([0.0, 1.0, 0.0, 0.0], [0.8, 0.3, 0.0, 0.001]), ([0.0, 0.0, 0.0, 0.0], [0.1, 0.9, 0.9, 0.001])]
    >>> for hit, p in scans:
    ...     memory, confirmed, alive = life.review(memory, Review(2.0, np.ones(4), np.array(hit), np.array(p)))
    ...     print(confirmed.tolist(), alive.tolist())
    [True, False, False, True] [True, True, True, True]
    [True, False, False, True] [True, True, False, True]
    [True, True, False, True] [False, True, False, True]
    [True, True, False, True] [False, True, False, False]
    """

    kind: ClassVar[str] = "coast_limited"
    certain: ClassVar[bool] = True

    hits: int = fields.integer("detections that confirm a track", default=3, at_least=1)
    tentative: float = fields.quantity("1", "detections due in a row that a tentative track may miss", default=1.5, above=0)
    confirmed: float = fields.quantity("1", "detections due in a row that a confirmed track may miss", default=5.0, above=0)

    def start_own(self, existence: Array) -> Coasting:
        """Return one hit for each track, which confirms it where `hits` is 1."""
        once = np.ones(existence.shape, dtype=np.int64)
        return Coasting(once, np.zeros(existence.shape), np.full(existence.shape, self.hits == 1))

    def judge(self, own: Coasting, scan: Review) -> tuple[Coasting, Mask, Mask]:
        """Count detections and expected ones, confirm and end."""
        detected = scan.hit > DETECTED
        hits = own.hits + detected
        missed = np.where(detected, 0.0, own.missed + scan.p_detect)
        confirmed = own.confirmed | (hits >= self.hits)
        alive = missed <= np.where(confirmed, self.confirmed, self.tentative)
        return Coasting(hits, missed, confirmed), confirmed, alive
