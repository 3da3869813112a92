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

    >>> import numpy as np
    >>> from vedette import Gaussian
    >>> model, T = TargetOrientedLiteral(sigma_forward=2.0, sigma_side=5.0, side_speed=1.5), 3.0
    >>> x = np.array([130.0, 90.0, 10.0, -2.0, 0.0, 100.0, 50.0])  # x, y, forward, to the right, heading, last x, last y
    >>> turned = model.reframe(Gaussian(x, np.eye(7)), Gaussian(x, np.eye(7)))  # it went 30 and 40 m
    >>> np.allclose(turned.mean, [130.0, 90.0, 10.0, 1.5, np.arctan2(40.0, 30.0), 130.0, 90.0])
    True
    >>> turned.cov.tolist() == np.eye(7).tolist()  # stays as it was
    True
    >>> B, G = np.array([[0.6, 0.8], [0.8, -0.6]]), np.array([T**2 / 2.0, T])  # forward, and to the right
    >>> np.allclose(model.move(turned.mean, T)[:2], [130.0, 90.0] + T * B @ [10.0, 1.5])
    True
    >>> gain = np.vstack([B * G[0], np.eye(2) * G[1]])
    >>> np.allclose(model.noise(turned.mean, T)[:4, :4], gain @ np.diag([4.0, 25.0]) @ gain.T)
    True
    """

    kind: ClassVar[str] = "target_oriented_literal"
    misprint: ClassVar[str] = (
        "section 3.1: v_side is reset and the covariance stays, so the filter reckons with a side speed that it discarded"
    )

    def reset(self, cov: Array) -> Array:
        """Return the covariance unchanged: (*b, 7, 7) -> (*b, 7, 7)."""
        return cov
