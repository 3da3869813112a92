"""Sea clutter and speckle on a polar grid: K-distributed power whose texture is correlated from turn to turn."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import Factory, define, field, frozen
from numpy.typing import NDArray

from vedette import Array, fields
from vedette_files.libraries import needed

Float32 = NDArray[np.float32]

_KEEP_EACH = 64
"""The texture's state is kept once in so many turns, so that every turn is near a kept one."""

_TABLE = 4096
"""Entries of the table that maps a standard normal number to the texture."""

_REACH = 6.0
"""Standard normal numbers beyond this are clipped to it."""


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    return needed("cv2", "simulated radar pictures need OpenCV", "vision")


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
        power: Array = 10.0 ** (self.level / 10.0) * (np.maximum(ranges, 30.0) / 1000.0) ** -3
        return power

    def rose(self, bearings: Array) -> Array:
        """Return the factor (*b) of the mean at true bearings (*b)."""
        factor: Array = 10.0 ** (self.upwind / 10.0 * np.maximum(np.cos(bearings - self.wind_from), 0.0) ** 2)
        return factor

    def texture(self, g: Float32) -> Float32:
        """Return T (*b) of standard normal numbers g (*b)."""
        at = np.clip((g + _REACH) * ((_TABLE - 1) / (2.0 * _REACH)) + 0.5, 0.0, _TABLE - 1.0)
        made: Float32 = self._table.take(at.astype(np.uint16))
        return made


def texture_table(shape: float) -> Float32:
    """Return the texture at `_TABLE` standard normal numbers from -_REACH to _REACH."""
    from scipy.special import gammainccinv, gammaincinv, ndtr

    g = np.linspace(-_REACH, _REACH, _TABLE)
    # Each half by the tail that is small there: 1 - Phi would lose precision in the other.
    value = np.where(g < 0, gammaincinv(shape, ndtr(np.minimum(g, 0.0))), gammainccinv(shape, ndtr(-np.maximum(g, 0.0))))
    return np.asarray(value / shape, dtype=np.float32)


@final
@frozen
class Upsampling:
    """Smooths white noise on a coarse grid to a field on a fine one, rows closed to a circle, variance 1 everywhere.

    It interpolates linearly, then applies a Gaussian of `spread` fine cells, down and across; each output is divided by the
    root of its weights' sum of squares.
    """

    coarse: tuple[int, int]
    factor: tuple[int, int]
    spread: tuple[float, float] = (0.0, 0.0)
    _scale: tuple[Float32, Float32] = field(
        init=False, repr=False, eq=False, default=Factory(lambda self: self._weigh(), takes_self=True)
    )

    @property
    def fine(self) -> tuple[int, int]:
        """Rows and columns of the output."""
        return self.coarse[0] * self.factor[0], self.coarse[1] * self.factor[1]

    def _weigh(self) -> tuple[Float32, Float32]:
        down = self._smooth(np.eye(self.coarse[0], dtype=np.float32), down=True)
        across = self._smooth(np.eye(self.coarse[1], dtype=np.float32), down=False)
        return (down**2).sum(axis=1, keepdims=True) ** -0.5, (across**2).sum(axis=0, keepdims=True) ** -0.5

    def _smooth(self, noise: Float32, *, down: bool) -> Float32:
        """Smooth in one direction: (n, m) -> (n f, m), or (n, m f)."""
        cv2 = opencv()
        f, spread = (self.factor[0], self.spread[0]) if down else (self.factor[1], self.spread[1])
        margin = 2 + int(np.ceil(4.0 * spread / f)) if down else 0
        if down:
            noise = np.concatenate([noise[-margin:], noise, noise[:margin]])
        rows, columns = noise.shape[:2]
        size = (columns, rows * f) if down else (columns * f, rows)
        out = cv2.resize(noise, size, interpolation=cv2.INTER_LINEAR) if f > 1 else noise
        if spread > 0:
            taps = gaussian_taps(spread)
            one = np.ones(1, dtype=np.float32)
            out = cv2.sepFilter2D(out, -1, one if down else taps, taps if down else one, borderType=cv2.BORDER_REPLICATE)
        kept: Float32 = out[margin * f : (rows - margin) * f] if down else out
        return kept

    def __call__(self, noise: Float32) -> Float32:
        """Map white noise (n, m) of variance 1 to the field (n f, m f')."""
        field = self._smooth(self._smooth(noise, down=False), down=True)
        field *= self._scale[0]
        field *= self._scale[1]
        return field

    def power(self, noise: Float32) -> Float32:
        """Map real and imaginary white noise (2, n, m) to the exponential power, mean 1, of the field (n f, m f')."""
        made, more = (self._smooth(self._smooth(part, down=False), down=True) for part in noise)
        made *= made
        more *= more
        made += more
        made *= self._scale[0] ** 2
        made *= np.float32(0.5) * self._scale[1] ** 2
        return made


def gaussian_taps(spread: float) -> Float32:
    """Return a Gaussian's weights at whole steps, with sum 1."""
    reach = int(np.ceil(4.0 * spread))
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / spread) ** 2)
    return np.asarray(taps / taps.sum(), dtype=np.float32)


@final
@define(eq=False)
class TextureMemory:
    """The Gaussian field of each turn on the coarse grid: g(k) = rho g(k-1) + sqrt(1 - rho^2) e(k), e(k) by its own seed.

    Some states are kept, so that any turn is a few steps from one; the result does not depend on earlier requests.
    """

    size: tuple[int, int]
    rho: float
    seed: int
    stream: int
    _kept: dict[int, Float32] = field(init=False, factory=dict)
    _last: tuple[int, Float32] | None = field(init=False, default=None)

    def at(self, turn: int) -> Float32:
        """Return the field of turn 0, 1, .."""
        start = max((k for k in self._kept if k <= turn), default=-1)
        state = self._kept.get(start)
        if self._last is not None and start <= self._last[0] <= turn:
            start, state = self._last
        for k in range(start + 1, turn + 1):
            fresh = own_stream(self.seed, self.stream, k).standard_normal(self.size, dtype=np.float32)
            if state is None:
                state = fresh
            else:
                state = np.float32(self.rho) * state + np.float32(np.sqrt(1.0 - self.rho**2)) * fresh
            if k % _KEEP_EACH == 0:
                self._kept[k] = state
        assert state is not None
        self._last = (turn, state)
        return state


def own_stream(seed: int, *key: int) -> np.random.Generator:
    """Return the random stream of one part of one turn, independent of all others."""
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=key))
