"""Changes of scene: a cut, or a camera that swings, after which nothing is where it was."""

from __future__ import annotations

import numpy as np

from vedette import Array

BLOCKS = 16
"""Blocks along each side of what is kept of a frame."""

SUDDEN = 3.0
"""Change over the largest recent one, beyond which a scene, and a block, changes suddenly."""

WIDE = 0.1
"""Part of the blocks that a change of scene changes so suddenly, at least: each of 13 cuts did of .16 and more. No target is
as large.
"""

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


def is_cut(before: Array, now: Array, recent: float, part: float) -> bool:
    """Return whether the scene is another: a change over `part` of the spread of `before`, beyond the `recent` ones in so
    many blocks that it is not that of a target before plain sky.
    """
    by = now - before
    sudden = np.abs(by - np.median(by)) > SUDDEN * recent
    return bool(change(before, now) > max(part * float(np.std(before)), SUDDEN * recent) and np.mean(sudden) > WIDE)
