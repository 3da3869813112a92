"""The target-oriented model with a side speed that is taken as known."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array
from vedette.filters import without_variance
from vedette_target_oriented.resets import ResettingMotion


@final
@frozen
class TargetOrientedCertain(ResettingMotion):
    """The other reading of the paper: v_side is reset after each scan and taken as known from then on, with variance 0.

    The direction of the last two positions is far less certain than that, so sigma_side must make up for it: on a straight
    line var/R of the side error is (2 - a)/(4 - 3a) for a steady gain a, and equals the a that the filter assumes only at
    a = 2/3, sigma_side = 4/sqrt(3) sigma/T^2.
    """

    kind: ClassVar[str] = "target_oriented_certain"
    misprint: ClassVar[str] = "section 3.1: v_side is reset, its variance too, so the filter takes its heading for certain"

    def reset(self, cov: Array) -> Array:
        """Set the side speed's variance to 0: (*b, 7, 7) -> (*b, 7, 7)."""
        return without_variance(cov, [3])
