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

    >>> from vedette import Gaussian
    >>> model = TargetOrientedSmoothed(sigma_forward=2.0, sigma_side=5.0, side_speed=1.5, heading_gain=0.25)
    >>> x = np.array([130.0, 90.0, 10.0, -2.0, -0.1, 100.0, 50.0])  # x, y, forward, to the right, heading, last x, last y
    >>> turned = model.reframe(Gaussian(x, np.eye(7)), Gaussian(x, np.eye(7)))  # it went 30 and 40 m
    >>> np.allclose(turned.mean, [130.0, 90.0, 10.0, 1.5, -0.075 + 0.25 * np.arctan2(40.0, 30.0), 130.0, 90.0])
    True
    >>> turned.cov.tolist() == np.eye(7).tolist(), model.steer(np.array(3.1), np.array(-3.1)).round(6).item()  # by .083 rad
    (True, 3.120796)
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
