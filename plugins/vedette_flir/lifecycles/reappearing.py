"""One target that may leave the image and come back."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Lifecycle, Mask, Review, fields


@final
@frozen
class ReappearingTarget(Lifecycle):
    """Keeps the given tracks to the end; their existence is the probability that the target is where the track says.

    A target is in view or away, a Markov chain with mean stays `shown` and `away`: between scans
    e <- s + (e - s) exp(-dt (1 / shown + 1 / away)), s = shown / (shown + away). After a scan e <- e L / (1 - e + e L), L
    the scan's likelihood ratio. A target that was lost is found again as its evidence returns, since e never stays at 0.
    Musicki, Evans, Integrated Probabilistic Data Association, IEEE T-AES 30, 1994 (two models of existence).

    >>> from vedette import Review
    >>> life = ReappearingTarget(shown=57.0, away=3.0)  # in view for 57 / 60 = .95 of the time
    >>> rate = 1.0 / 57.0 + 1.0 / 3.0
    >>> np.allclose(life.predict(np.array([0.2, 1.0]), 4.0), 0.95 + np.array([-0.75, 0.05]) * np.exp(-4.0 * rate))
    True
    >>> scan = Review(4.0, np.array([0.9, 0.0]), np.zeros(2), np.ones(2))
    >>> memory, confirmed, alive = life.review(life.start(np.ones(2)), scan)
    >>> confirmed.tolist(), alive.tolist(), life.usual_birth["kind"]
    ([True, True], [True, True], 'given')
    """

    kind: ClassVar[str] = "reappearing_target"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "given"}
    known_failures: ClassVar[Mapping[str, str]] = {
        "survival_is_a_probability": "a target that is away comes back, so its existence may rise with time",
        "unseen_tracks_end": "the given targets are kept to the end, lost or not",
        "what_does_not_exist_is_not_confirmed": "the given targets are confirmed throughout",
    }

    shown: float = fields.quantity("s", "mean time for which the target stays in view", default=60.0, above=0)
    away: float = fields.quantity("s", "mean time for which it stays away", default=3.0, above=0)

    def start(self, existence: Array) -> None:
        """Return no memory."""

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the existence `dt` s later: (*b, t) -> (*b, t)."""
        settled = self.shown / (self.shown + self.away)
        return settled + (existence - settled) * math.exp(-dt * (1.0 / self.shown + 1.0 / self.away))

    def review(self, memory: None, scan: Review) -> tuple[None, Mask, Mask]:
        """Return that every track is confirmed and alive."""
        always = np.ones(scan.existence.shape, dtype=bool)
        return None, always, always
