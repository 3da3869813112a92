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

    >>> import numpy as np
    >>> from vedette import Gaussian
    >>> model, T = TargetOrientedCertain(sigma_forward=2.0, sigma_side=5.0, side_speed=1.5), 3.0
    >>> x = np.array([130.0, 90.0, 10.0, -2.0, 0.0, 100.0, 50.0])  # x, y, forward, to the right, heading, last x, last y
    >>> turned = model.reframe(Gaussian(x, np.eye(7)), Gaussian(x, np.eye(7)))  # it went 30 and 40 m
    >>> np.allclose(turned.mean, [130.0, 90.0, 10.0, 1.5, np.arctan2(40.0, 30.0), 130.0, 90.0])
    True
    >>> turned.cov.tolist() == np.diag([1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]).tolist()  # the side speed is taken as known
    True
    >>> B, G = np.array([[0.6, 0.8], [0.8, -0.6]]), np.array([T**2 / 2.0, T])  # forward, and to the right
    >>> np.allclose(model.move(turned.mean, T)[:2], [130.0, 90.0] + T * B @ [10.0, 1.5])
    True
    >>> gain = np.vstack([B * G[0], np.eye(2) * G[1]])
    >>> np.allclose(model.noise(turned.mean, T)[:4, :4], gain @ np.diag([4.0, 25.0]) @ gain.T)
    True
    """

    kind: ClassVar[str] = "target_oriented_certain"
    misprint: ClassVar[str] = "section 3.1: v_side is reset, its variance too, so the filter takes its heading for certain"

    def reset(self, cov: Array) -> Array:
        """Set the side speed's variance to 0: (*b, 7, 7) -> (*b, 7, 7)."""
        return without_variance(cov, [3])
