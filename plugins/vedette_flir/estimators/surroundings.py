"""How far a thing has gone before what is around it: a part of the scene goes nowhere, whatever the camera does."""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask
from vedette_flir.patches import blurred, sample
from vedette_flir.sources.images import opencv

CELLS = 32
"""Side of the grid over a thing's surroundings."""

REACH, ROOM = 3.0, 12.0
"""Side of the surroundings over the thing's size, and px beyond that."""

OWN, HALO = 1.2, 2.0
"""Distance within which a pixel is the thing's own, over its size, and px beyond that: cameras and codecs draw a halo."""

SURE, WIDE = 0.35, 2.0
"""Standard deviation in px up to which the surroundings tell, and cells up to which slopes do."""

FAR = 8
"""Cells to each side at which the surroundings are sought."""

FEWEST, ALIKE, NOISE = 60, 4.0, 0.42
"""Cells that both frames must show; neighbouring cells that err alike; the variance of a slope of smoothed white noise over
the noise's, a cell apart.
"""


def around(pixels: Array, place: Array, size: Array) -> Array:
    """Return what is around a place (2,) of a frame (h, w): (32, 32), NaN outside the frame."""
    step, x, y = _grid(place, size)
    image = blurred(sample(pixels, place, step, CELLS))
    return np.where(_within(y, pixels.shape[0])[:, None] & _within(x, pixels.shape[1]), image, np.nan)


def gone(first: Array, pixels: Array, place: Array, origin: Array, size: Array) -> Array:
    """Return by how many px (2,) a thing has moved before its surroundings, from its `origin` to its `place`.

    What was around it (`first`), and is now, differs by its slopes times a shift, by least squares (Lucas, Kanade, An
    iterative image registration technique, IJCAI 1981), seen from the thing, or from its origin, or from where they look
    most alike, whichever explains more. Along axes with less slope than noise, as before plain sky, the surroundings count
    as standing still.
    """
    shift, step = place - origin, _grid(place, size)[0]
    slopes = np.stack([np.gradient(first, step, axis=axis) for axis in (1, 0)])
    known = np.isfinite(slopes).all(axis=0) & ~_own(np.zeros(2), size)
    best, told = np.inf, shift
    for start in (shift, np.zeros(2), shift + _nearest(first, known, pixels, place, step)):
        change = around(pixels, origin + start, size) - first
        seen = known & np.isfinite(change) & ~_own(shift - start, size) & ~_own(start - shift, size)
        if (count := int(seen.sum())) < FEWEST:
            continue
        G, r = slopes[:, seen], change[seen] - np.mean(change[seen])
        G = G - G.mean(axis=1, keepdims=True)  # a camera's level changes as a slope would
        energy, axes = np.linalg.eigh(G @ G.T)
        more = axes.T @ (G @ r) / np.maximum(energy, 1e-9)
        rest = float(np.var(r - (axes @ more) @ G))
        if rest >= best:
            continue
        signal = energy - count * NOISE * 0.5 * rest / step**2
        sure = (signal > 0.5 * energy) & (np.sqrt(ALIKE * rest / np.maximum(signal, 1e-9)) < SURE)
        more = more * energy / np.maximum(signal, 1e-9)
        sure &= np.abs(more) < WIDE * step
        best, told = rest, axes @ np.where(sure, axes.T @ (shift - start) + more, axes.T @ shift)
    return np.asarray(told)


def _nearest(first: Array, known: Mask, pixels: Array, place: Array, step: float) -> Array:
    """Return the offset (2,) in px from `place` at which the frame is most like what was around the thing first."""
    if known.sum() < FEWEST:
        return np.zeros(2)
    wide = blurred(sample(pixels, place, step, CELLS + 2 * FAR)).astype(np.float32)
    template = np.where(known, first, 0.0).astype(np.float32)
    likeness = opencv().matchTemplate(wide, template, opencv().TM_CCOEFF_NORMED, mask=known.astype(np.float32))
    row, column = np.unravel_index(np.argmax(np.where(np.isfinite(likeness), likeness, -1.0)), likeness.shape)
    return step * (np.array([column, row]) - FAR)


def _grid(place: Array, size: Array) -> tuple[float, Array, Array]:
    """Return step, columns and rows of the grid in px."""
    step = max(1.0, (REACH * float(np.max(size)) + ROOM) / CELLS)
    along = step * (np.arange(CELLS) - 0.5 * (CELLS - 1))
    return step, place[0] + along, place[1] + along


def _own(offset: Array, size: Array) -> Mask:
    """Return the cells (32, 32) that belong to a thing `offset` (2,) px from the middle of the grid."""
    _, x, y = _grid(-offset, size)
    reach = OWN * size + HALO
    own: Mask = (y[:, None] / reach[1]) ** 2 + (x / reach[0]) ** 2 < 1.0
    return own


def _within(at: Array, side: int) -> Mask:
    inside: Mask = (at >= 0.0) & (at <= side - 1.0)
    return inside
