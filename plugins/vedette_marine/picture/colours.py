"""From a radar picture in colour to the grey level of its echoes; what has no echo's colour is the interface's."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array, Mask
from vedette_marine.opencv import opencv

Bytes = NDArray[np.uint8]
"""A picture of 8 bit: grey (h, w), or in colour (h, w, 3), blue first."""

STEP = 8
"""Counts between the colours that the table holds: 32 a channel."""

LINE = 5
"""px: where the interface is narrower than this, an echo goes on behind it."""


@frozen(eq=False)
class Palette:
    """Grey levels of coarse colours, `table` (32^3,), and which are the interface's: `foreign` (32^3,), grey 0."""

    table: Bytes
    foreign: Mask

    @classmethod
    def of(cls, colours: Array, tolerance: float) -> Palette:
        """Nearest of 256 steps along the line through `colours` (n, 3), red first; farther than `tolerance` counts: 0."""
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
        """(h, w, 3) -> (h, w); what lies under a line of the interface is bridged."""
        cv2 = opencv()
        coarse = cv2.LUT(picture, _COARSE)
        blue, green, red = cv2.split(coarse)
        index = blue.astype(np.uint16) << 10 | green.astype(np.uint16) << 5 | red
        return bridged(self.table[index], self.foreign[index])


def bridged(grey: Bytes, hidden: Mask) -> Bytes:
    """`grey` (h, w) with its `hidden` pixels (h, w) as bright as what is on both sides of them, within `LINE` px: a heading
    line or range ring over a ship would cut it in two.

    That is the grey closing, the least of the greatest levels in all squares around a pixel: no echo is made of nothing.
    """
    cv2 = opencv()
    closed: Bytes = cv2.morphologyEx(grey, cv2.MORPH_CLOSE, np.ones((LINE, LINE), dtype=np.uint8))
    return np.where(hidden, closed, grey)


@lru_cache(maxsize=8)
def palette(colours: tuple[tuple[float, ...], ...], tolerance: float) -> Palette:
    """The table of a palette, kept: all pictures of a recording have one."""
    return Palette.of(np.array(colours), tolerance)


_COARSE = (np.arange(256) // STEP).astype(np.uint8)


def plain_grey(picture: Bytes) -> Bytes:
    """(h, w) as it is; (h, w, 3) by the usual weights of the channels."""
    if picture.ndim == 2:
        return picture
    cv2: Any = opencv()
    grey: Bytes = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY)
    return grey
