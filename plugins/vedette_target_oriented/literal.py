"""The target-oriented model as printed: the covariance ignores the reset."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array
from vedette_target_oriented.resets import ResettingMotion


@final
@frozen
class TargetOrientedLiteral(ResettingMotion):
    """The paper's model taken literally: v_side is reset after each scan, and the covariance stays as it was.

    The filter then relies on a side speed that it has discarded: on the truth of its models its squared error is over
    twice what its covariance says. `target_oriented` is the consistent model.
    """

    kind: ClassVar[str] = "target_oriented_literal"
    misprint: ClassVar[str] = (
        "section 3.1: v_side is reset and the covariance stays, so the filter reckons with a side speed that it discarded"
    )

    def reset(self, cov: Array) -> Array:
        """Return the covariance unchanged: (*b, 7, 7) -> (*b, 7, 7)."""
        return cov
