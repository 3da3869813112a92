"""Confirmation and deletion by the track's score: a sequential probability ratio test."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Mask, Review, fields, maker
from vedette_standard.compiled import fastest
from vedette_standard.lifecycles.limited import Limited

_CERTAIN = 1.0 - 5e-13
"""Existence is kept below this, so that its odds stay finite and misses can still end a track."""


@frozen(eq=False)
class Scores:
    """first: the log odds of existence at the start; last: the score; fell: how far it is below its best; all (*b, t)."""

    first: Array
    last: Array
    fell: Array
    confirmed: Mask


@final
@frozen
class Score(Limited):
    """Wald's test between a target and a run of false returns, on the log-likelihood ratio of all scans.

    The score is the log odds of existence, which the tracker updates for every associator, less those of a new
    track. A tentative track is confirmed at log((1 - beta)/alpha) and ends at log(beta/(1 - alpha)), alpha = `false_tracks`,
    beta = `lost_targets`. A confirmed one, whose score grows without bound, ends once it has fallen `drop` below its best.
    Where hypotheses are kept, a history of the track ends by the score of its own, too, and its fall is that one's. A fall
    counts as far as a miss explains it: what hypotheses drop or decide makes the odds of a sure target jump.
    Wald, Sequential Tests of Statistical Hypotheses, Annals of Mathematical Statistics 16, 1945.

    >>> from vedette import Review
    >>> from vedette_standard.regions import Polygon
    >>> corner = Polygon([[0.0, 0.0], [90.0, 0.0], [0.0, 90.0]])
    >>> life = Score(false_tracks=0.01, lost_targets=0.1, drop=3.0, survives_in=(corner,))  # log(.9/.01) = 4.500
    >>> memory, off, place = life.start(np.full(5, 0.2)), np.zeros(5), np.array([[10.0, 20.0]] * 4 + [[50.0, 60.0]])
    >>> for score in ([4.51, 4.49, -2.28, -2.3, 1.0], [8.0, 4.6, 0.0, -2.3, 1.0], [5.1, 1.5, 0.0, -2.3, 1.0]):
    ...     existence = 1.0 / (1.0 + 4.0 * np.exp(-np.array(score)))  # first, odds of 1 to 4; ends at log(.1/.99) = -2.293
    ...     memory, confirmed, alive = life.review(memory, Review(2.0, existence, off, off + 0.99, place=place))
    ...     print(confirmed.tolist(), alive.tolist())
    [True, False, False, False, False] [True, True, True, False, False]
    [True, True, False, False, False] [True, True, True, False, False]
    [True, True, False, False, False] [True, False, True, False, False]
    >>> life.predict(np.array([0.3]), 50.0).tolist(), bool(life.predict(np.ones(1), 50.0)[0] < 1.0)
    ([0.3], True)
    """

    kind: ClassVar[str] = "score"
    abbreviations: ClassVar[tuple[str, ...]] = ("sprt",)
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "from_returns", "initial": 0.1}

    false_tracks: float = fields.probability("share of false tracks that may be confirmed", default=1e-3, above=0, below=0.5)
    lost_targets: float = fields.probability("share of targets that may end tentative", default=0.05, above=0, below=0.5)
    drop: float = fields.quantity("1", "fall of the score, in nats, that ends a confirmed track", default=10.0, above=0)

    def start_own(self, existence: Array) -> Scores:
        """Return score 0 for each track, none confirmed."""
        doubted = np.clip(existence, 1.0 - _CERTAIN, _CERTAIN)
        none = np.zeros(existence.shape)
        return Scores(np.log(doubted / (1.0 - doubted)), none, none, none > 0)

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the same existence, below the limit: the test does not depend on time."""
        return np.minimum(existence, _CERTAIN)

    def judge(self, own: Scores, scan: Review) -> tuple[Scores, Mask, Mask]:
        """Confirm and end by the thresholds."""
        confirm = math.log((1.0 - self.lost_targets) / self.false_tracks)
        end = math.log(self.lost_targets / (1.0 - self.false_tracks))
        history = scan.existence if scan.own is None else scan.own
        known = own.first, own.last, own.fell, own.confirmed, scan.existence, history, scan.p_detect
        last, fell, confirmed, alive = by_score(*known, _CERTAIN, confirm, end, self.drop)
        return new_scores(own.first, last, fell, confirmed), confirmed, alive | self.unseen(scan)


new_scores = maker(Scores)


@fastest
def by_score(
    first: Array,
    last: Array,
    fell: Array,
    confirmed: Mask,
    existence: Array,
    own: Array,
    p_detect: Array,
    most: float,
    confirm: float,
    end: float,
    drop: float,
) -> tuple[Array, Array, Mask, Mask]:
    """Return the own score after a scan, how far it is below its best, which tracks are confirmed, and which are alive."""
    doubted = np.clip([existence, own], 1.0 - most, most)
    score, alone = np.log(doubted) - np.log1p(-doubted) - first
    fell = np.maximum(fell + np.minimum(last - alone, -np.log1p(-np.minimum(p_detect, most))), 0.0)
    confirmed = confirmed | (score >= confirm)
    return alone, fell, confirmed, np.where(confirmed, fell < drop, np.minimum(score, alone) > end)
