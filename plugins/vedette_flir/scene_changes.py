"""Changes of scene: a cut, or a camera that swings, after which nothing is where it was."""

from __future__ import annotations

import numpy as np

from vedette import Array

BLOCKS = 16
"""Blocks along each side of what is kept of a frame."""

SUDDEN = 3.0
"""Change over the recent changes, beyond which the scene is another."""

WIDE = 0.12
"""Median change of a block over the root mean square: .67 where all change alike, as in normal noise."""

FADING = 0.95
"""Part of the largest recent change that is left a frame later."""


def outline(pixels: Array) -> Array:
    """Return the means of a frame (h, w) over blocks, less their own mean: (16, 16). Of a large frame some pixels count."""
    stride = max(1, min(pixels.shape) // (4 * BLOCKS))
    seen = pixels[::stride, ::stride]
    rows, columns = (np.linspace(0, size, BLOCKS, endpoint=False).astype(np.intp) for size in seen.shape)
    sums = np.add.reduceat(np.add.reduceat(seen, rows, axis=0, dtype=float), columns, axis=1)
    down, across = (np.maximum(np.diff(first, append=n), 1) for first, n in zip((rows, columns), seen.shape, strict=True))
    means = sums / (down[:, None] * across)
    apart: Array = means - means.mean()
    return apart


def change(before: Array, now: Array) -> float:
    """Return the root mean square difference of two outlines, in count."""
    return float(np.sqrt(np.mean((now - before) ** 2)))


def is_wide(before: Array, now: Array, changed: float) -> bool:
    """Return whether half the blocks or more took part in a change, so that it is not that of a target before plain sky."""
    return bool(np.median(np.abs(now - before)) > WIDE * changed)


def is_cut(before: Array, changed: float, recent: float, part: float) -> bool:
    """Return whether the scene is another: a change over `part` of the spread of `before`, and beyond the `recent` ones."""
    return changed > part * float(np.std(before)) and changed > SUDDEN * recent
