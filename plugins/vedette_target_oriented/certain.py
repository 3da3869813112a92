"""The target-oriented model with a side speed that counts as known."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array
from vedette.filters import without_variance
from vedette_target_oriented.resets import ResettingMotion


@final
@frozen
class TargetOrientedCertain(ResettingMotion):
    """The other reading of the paper: v_side is set anew after each scan, and known from then on: its variance is 0.

    The direction of the last two positions is far less sure than that, so sigma_side must make up for it: on a straight line
    var/R of the side error is (2 - a)/(4 - 3a) for a steady gain a, and equals the a that the filter reckons with only at
    a = 2/3, sigma_side = 4/sqrt(3) sigma/T^2.
    """

    kind: ClassVar[str] = "target_oriented_certain"

    def reset(self, cov: Array) -> Array:
        """(*b, 7, 7) -> (*b, 7, 7) without the side speed's variance"""
        return without_variance(cov, [3])
