"""Random fields on a grid of sweeps and range bins: smooth in space, new in each turn of the antenna or going on from it."""

from __future__ import annotations

from typing import Any, final

import numpy as np
from attrs import Factory, define, field, frozen
from numpy.typing import NDArray

from vedette_files.libraries import needed

Float32 = NDArray[np.float32]

_KEEP_EACH = 64
"""The texture's state is kept once in so many turns, so that every turn is near a kept one."""


def opencv() -> Any:
    """Return the module `cv2`; InputError if it is not installed."""
    return needed("cv2", "simulated radar pictures need OpenCV", "vision")


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
        return out[margin * f : (rows - margin) * f] if down else out

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
