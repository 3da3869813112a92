"""The target-oriented model with a heading from a filter of its own."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, fields
from vedette_target_oriented.resets import ResettingMotion


@final
@frozen
class TargetOrientedSmoothed(ResettingMotion):
    """The alternative of section 3.1: the heading is filtered, heading += gain * (direction of two positions - heading).

    That is the steady Kalman filter of a heading that walks at random, and about the mean over the last 2/gain - 1
    directions. The paper does not take it, as it lags where manoeuvres begin and end. Else as `target_oriented_literal`.
    Yoon, Ko, a manoeuvring target tracking algorithm with a target-oriented velocity representation (in Korean).
    """

    kind: ClassVar[str] = "target_oriented_smoothed"
    misprint: ClassVar[str] = "section 3.1: the heading lags, and v_side is reset as in `target_oriented_literal`"

    heading_gain: float = fields.probability(
        "part of the way to each new direction that the heading goes", default=0.5, above=0
    )

    def steer(self, before: Array, now: Array) -> Array:
        """Return the filtered heading: (*b), (*b) -> (*b)."""
        apart = now - before
        return before + self.heading_gain * np.arctan2(np.sin(apart), np.cos(apart))

    def reset(self, cov: Array) -> Array:
        """Return the covariance unchanged: (*b, 7, 7) -> (*b, 7, 7)."""
        return cov
