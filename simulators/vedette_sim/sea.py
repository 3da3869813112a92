"""Sea clutter: K-distributed power, of which the texture is correlated from turn to turn."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, fields
from vedette_sim.polar_fields import Float32

_TABLE = 4096
"""Entries of the table that maps a standard normal number to the texture."""

_REACH = 6.0
"""Standard normal numbers beyond this are clipped to it."""


@final
@frozen
class SeaClutter:
    """K-distributed sea clutter: power = mean(R) T E with a gamma texture T of mean 1 and exponential speckle E.

    T = F^-1(Phi(g)), F the gamma distribution with shape nu and scale 1 / nu, g a standard Gaussian field, smooth in space,
    with autocorrelation e^(-t / tau) in time. Moments of the power z: <z^n> = n! Gamma(n + nu) / (nu^n Gamma(nu)) mean^n.
    Ward, Tough, Watts, Sea Clutter, 2nd ed., ch. 4.

    >>> sea = SeaClutter(shape=0.5, level=7.0, wind_from=0.5, upwind=6.0)
    >>> np.allclose(sea.mean(np.array([1000.0, 2000.0])), [10**0.7, 10**0.7 / 8])
    True
    >>> np.allclose(10 * np.log10(sea.rose(np.array([0.5, 1.5, 2.2, -2.0]))), [6.0, 6 * np.cos(1.0) ** 2, 0.0, 0.0])
    True
    >>> from scipy.special import ndtri
    >>> T = sea.texture(ndtri((np.arange(100_000) + 0.5) / 100_000).astype(np.float32))
    >>> np.allclose([np.mean(T), np.mean(T**2)], [1.0, 1 + 1 / 0.5], rtol=0.01)
    True
    """

    shape: float = fields.quantity("1", "nu, the texture's shape: small is spiky", default=1.0, at_least=0.05, at_most=1000)
    level: float = fields.quantity("1", "decibels above the noise at 1 km; falls by R^-3", default=5.0, at_most=100)
    seconds: float = fields.quantity("s", "time tau after which the texture's g is correlated by 1/e", default=6.2, above=0)
    wind_from: float = fields.quantity("rad", "where the wind comes from, clockwise from north", default=0.0)
    upwind: float = fields.quantity(
        "1", "decibels upwind above those across and downwind", default=0.0, at_least=0, at_most=30
    )
    _table: Float32 = field(
        init=False, repr=False, eq=False, default=Factory(lambda self: texture_table(self.shape), takes_self=True)
    )

    def mean(self, ranges: Array) -> Array:
        """Return the mean power relative to the noise's at ranges (*b) in m, across the wind."""
        return 10.0 ** (self.level / 10.0) * (np.maximum(ranges, 30.0) / 1000.0) ** -3

    def rose(self, bearings: Array) -> Array:
        """Return the factor (*b) of the mean at true bearings (*b)."""
        return 10.0 ** (self.upwind / 10.0 * np.maximum(np.cos(bearings - self.wind_from), 0.0) ** 2)

    def texture(self, g: Float32) -> Float32:
        """Return T (*b) of standard normal numbers g (*b)."""
        at = np.clip((g + _REACH) * ((_TABLE - 1) / (2.0 * _REACH)) + 0.5, 0.0, _TABLE - 1.0)
        return self._table.take(at.astype(np.uint16))


def texture_table(shape: float) -> Float32:
    """Return the texture at `_TABLE` standard normal numbers from -_REACH to _REACH."""
    from scipy.special import gammainccinv, gammaincinv, ndtr

    g = np.linspace(-_REACH, _REACH, _TABLE)
    # Each half by the tail that is small there: 1 - Phi would lose precision in the other.
    value = np.where(g < 0, gammaincinv(shape, ndtr(np.minimum(g, 0.0))), gammainccinv(shape, ndtr(-np.maximum(g, 0.0))))
    return np.asarray(value / shape, dtype=np.float32)
