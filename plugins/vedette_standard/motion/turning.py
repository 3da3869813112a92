"""The functions of the turned angle that coordinated turns are made of, without cancellation at 0."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array

_SWITCH = 0.25
"""Half angle in rad below which the series of rho is exact to rounding; above, the closed form loses little over a digit."""


@frozen(eq=False)
class Turn:
    """A turn by the angles A (*b), through their halves h = A/2: the chord of an arc points along its middle.

    Every field and property has shape (*b). cos and sin are those of h, sinc = sin(h)/h.
    """

    half: Array
    cos: Array
    sin: Array
    sinc: Array

    @classmethod
    def by(cls, angle: Array | float) -> Turn:
        """Return the turn by the angle (*b) in rad, counter-clockwise."""
        half = np.asarray(angle) / 2
        sin = np.sin(half)
        return cls(half, np.cos(half), sin, np.divide(sin, half, out=np.ones_like(sin), where=half != 0))

    def halfway(self, vx: Array, vy: Array) -> tuple[Array, Array]:
        """Return a vector, (*b) by component, turned by h."""
        return self.cos * vx - self.sin * vy, self.sin * vx + self.cos * vy

    @property
    def cos_angle(self) -> Array:
        """The cosine of A."""
        return 1.0 - 2.0 * self.sin**2

    @property
    def sin_angle(self) -> Array:
        """The sine of A."""
        return 2.0 * self.sin * self.cos

    @property
    def along(self) -> Array:
        """sin(A)/A: displacement along the first heading, per path length."""
        return self.sinc * self.cos

    @property
    def across(self) -> Array:
        """(1 - cos A)/A: displacement to the left of the first heading, per path length."""
        return self.sinc * self.sin

    @property
    def rho(self) -> Array:
        """(cos(h) - sinc)/h^2 = -1/3 + h^2/30 - h^4/840 + ..., of which h rho is the derivative of sinc.

        It is the only one that needs a series near 0: all else here is made of sums and products without cancellation.
        """
        square = self.half**2
        small = np.abs(self.half) < _SWITCH
        tail = 1 / 840 - square * (1 / 45360 - square * (1 / 3991680 - square / 518918400))
        series = -1 / 3 + square * (1 / 30 - square * tail)
        return np.where(small, series, (self.cos - self.sinc) / np.where(small, 1.0, square))

    @property
    def even(self) -> Array:
        """(1 - cos A)/A^2"""
        return 0.5 * self.sinc**2

    @property
    def odd(self) -> Array:
        """(A - sin A)/A^3"""
        return 0.25 * (self.sinc**2 + self.cos * self.rho)
