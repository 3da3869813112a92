"""The target-oriented model as printed: the covariance does not know of the reset."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array
from vedette_target_oriented.resets import ResettingMotion


@final
@frozen
class TargetOrientedLiteral(ResettingMotion):
    """The paper's model read to the letter: v_side is set anew after each scan, and the covariance stays what it was.

    The filter then believes in a side speed that it has thrown away: on the truth of its models its squared error is over
    twice what its covariance says. `target_oriented` is the consistent model.
    """

    kind: ClassVar[str] = "target_oriented_literal"

    def reset(self, cov: Array) -> Array:
        """(*b, 7, 7) -> (*b, 7, 7), the same"""
        return cov
