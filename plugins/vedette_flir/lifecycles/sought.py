"""Targets that are found without being given, lost, and found again."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Lifecycle, Mask, Review, fields


@frozen(eq=False)
class Course:
    """Whether a track was ever confirmed, its age in s, and for how long it has been lost, in s; all (*b, t)."""

    confirmed: Mask
    age: Array
    lost: Array


@final
@frozen
class SoughtTarget(Lifecycle):
    """Confirms a track whose target is there with probability `confirm`, and keeps it while it is lost for up to `forget`.

    Between scans e <- s + (e - s) exp(-dt (1 / shown + 1 / away)), s = shown / (shown + away), as in `reappearing_target`. A
    track is confirmed once e is at least `confirm` and it is `settled` s old. It ends below `delete` before that, or when it
    was lost, with e below one half, for `forget` s.
    Musicki, Evans, Integrated Probabilistic Data Association, IEEE T-AES 30, 1994 (two models of existence).

    >>> from vedette import Review
    >>> life = SoughtTarget(shown=57.0, away=3.0, confirm=0.9, settled=2.0, delete=0.2, forget=4.0)
    >>> np.allclose(life.predict(np.array([0.2]), 4.0), 0.95 - 0.75 * np.exp(-4.0 * (1.0 / 57.0 + 1.0 / 3.0)))
    True
    >>> memory, none = life.start(np.full(3, 0.5)), np.zeros(3)  # one is lost, one is found again, one is never confirmed
    >>> for existence, p in ([0.95, 0.9, 0.21], 1), ([0.9, 0.9, 0.2], 1), ([0.49, 0.49, 0.19], 1), ([0.4, 0.5, 0], 0):
    ...     memory, confirmed, alive = life.review(memory, Review(1.5, np.array(existence), none, none + p))
    ...     print(confirmed.tolist(), alive.tolist())
    [False, False, False] [True, True, True]
    [True, True, False] [True, True, True]
    [True, True, False] [True, True, False]
    [True, True, False] [True, True, False]
    >>> for _ in range(2):  # lost for 3 s and 4.5 s, as nothing was looked at in one scan, and for 1.5 and 3 s
    ...     memory, confirmed, alive = life.review(memory, Review(1.5, np.array([0.4, 0.4, 0.0]), none, none + 1))
    ...     print(alive.tolist())
    [True, True, False]
    [False, True, False]
    """

    kind: ClassVar[str] = "sought_target"
    usual_birth: ClassVar[Mapping[str, Any]] = {"kind": "detected"}
    known_failures: ClassVar[Mapping[str, str]] = {
        "survival_is_a_probability": "a target that is away comes back, so its existence may rise with time",
        "unseen_tracks_end": "a confirmed track is kept for `forget`, lost or not",
    }

    shown: float = fields.quantity("s", "mean time for which the target stays in view", default=60.0, above=0)
    away: float = fields.quantity("s", "mean time for which it stays away", default=3.0, above=0)
    confirm: float = fields.probability("existence that confirms a track", default=0.99, tried=(0.99, 0.7))
    settled: float = fields.quantity("s", "age from which a track may be confirmed", default=0.5, at_least=0)
    delete: float = fields.probability(
        "existence that ends a track that was never confirmed", default=0.03, tried=(0.03, 0.3)
    )
    forget: float = fields.quantity("s", "time after which a lost track ends", default=10.0, above=0)

    def start(self, existence: Array) -> Course:
        """Return tracks that were never confirmed."""
        return Course(np.zeros(existence.shape, dtype=bool), np.zeros(existence.shape), np.zeros(existence.shape))

    def predict(self, existence: Array, dt: float) -> Array:
        """Return the existence `dt` s later: (*b, t) -> (*b, t)."""
        settled = self.shown / (self.shown + self.away)
        return settled + (existence - settled) * math.exp(-dt * (1.0 / self.shown + 1.0 / self.away))

    def review(self, memory: Course, scan: Review) -> tuple[Course, Mask, Mask]:
        """Compare existence, age and time of the loss with their limits."""
        age = memory.age + scan.dt
        looked = np.where(scan.p_detect > 0, scan.dt, 0.0)  # while nothing could be detected, nothing was lost
        lost = np.where(scan.existence < 0.5, memory.lost + looked, 0.0)
        confirmed = memory.confirmed | ((scan.existence >= self.confirm) & (age >= self.settled))
        alive = np.where(confirmed, lost < self.forget, scan.existence >= self.delete)
        return Course(confirmed, age, lost), confirmed, alive
