"""From a radar picture in colour to the grey level of its echoes; any other colour belongs to the interface."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, Mask
from vedette_marine.opencv import opencv

Bytes = NDArray[np.uint8]
"""An 8 bit picture: grey (h, w), or in colour (h, w, 3), blue first."""

STEP = 8
"""Counts between the colours of the table: 32 a channel."""

LINE = 5
"""Width in px up to which a line of the interface is bridged: an echo continues behind it."""


@frozen(eq=False)
class Palette:
    """Grey levels of coarse colours, `table` (32^3,), and which are the interface's: `foreign` (32^3,), grey 0."""

    table: Bytes
    foreign: Mask

    @classmethod
    def of(cls, colours: Array, tolerance: float) -> Palette:
        """Take the nearest of 256 steps along the line through `colours` (n, 3), red first; 0 beyond `tolerance` counts."""
        levels = np.linspace(0, len(colours) - 1, 256)
        line = np.stack([np.interp(levels, range(len(colours)), channel) for channel in colours.T], axis=-1)[:, ::-1]
        middles = np.arange(STEP / 2, 256, STEP)
        blue, green, red = np.meshgrid(middles, middles, middles, indexing="ij")
        cells = np.stack([blue, green, red], axis=-1).reshape(-1, 3)
        apart = np.sum(cells**2, axis=1)[:, None] - 2 * cells @ line.T + np.sum(line**2, axis=1)
        nearest = np.argmin(apart, axis=1)
        far = apart[np.arange(len(cells)), nearest] > (tolerance + STEP) ** 2
        return cls(np.where(far, 0, nearest).astype(np.uint8), far)

    def grey(self, picture: Bytes) -> Bytes:
        """Map (h, w, 3) to (h, w), bridging what lies under a line of the interface."""
        cv2 = opencv()
        coarse = cv2.LUT(picture, _COARSE)
        blue, green, red = cv2.split(coarse)
        index = blue.astype(np.uint16) << 10 | green.astype(np.uint16) << 5 | red
        return bridged(self.table[index], self.foreign[index])


def bridged(grey: Bytes, hidden: Mask) -> Bytes:
    """Return `grey` (h, w) with its `hidden` pixels (h, w) as bright as what is on both sides of them, within `LINE` px: a
    heading line or range ring over a ship would cut it in two.

    This is the grey closing, the least of the greatest levels in all squares around a pixel: it creates no new echo.
    """
    cv2 = opencv()
    closed: Bytes = cv2.morphologyEx(grey, cv2.MORPH_CLOSE, np.ones((LINE, LINE), dtype=np.uint8))
    return np.where(hidden, closed, grey)


@lru_cache(maxsize=8)
def palette(colours: tuple[tuple[float, ...], ...], tolerance: float) -> Palette:
    """Return the table of a palette, cached: all pictures of a recording share one."""
    return Palette.of(np.array(colours), tolerance)


_COARSE = (np.arange(256) // STEP).astype(np.uint8)


def plain_grey(picture: Bytes) -> Bytes:
    """Return (h, w) as it is, or (h, w, 3) weighted as usual over the channels."""
    if picture.ndim == 2:
        return picture
    cv2: Any = opencv()
    return cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
