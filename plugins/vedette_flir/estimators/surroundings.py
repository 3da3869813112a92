"""How far a thing has gone before what is around it: a part of the scene goes nowhere, whatever the camera does."""

from __future__ import annotations

from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Mask
from vedette_flir.patches import HALO, blurred, sample
from vedette_flir.sources.images import opencv

SURE, WIDE = 0.35, 2.0
"""Standard deviation in px up to which what is around a thing tells where it is, and cells up to which slopes do."""

FAR = 8
"""Cells to each side at which the surroundings are sought."""

FEWEST, ALIKE, NOISE = 60, 4.0, 0.42
"""Cells that both frames must show; neighbouring cells that err alike; the variance of a slope of smoothed white noise over
the noise's, a cell apart.
"""


@final
@frozen
class Grid:
    """A grid of `cells` a side over what is around a thing, `reach` times its size and `room` px wide.

    Within `own` times its size, and the halo, a pixel is the thing's.
    """

    cells: int
    reach: float
    room: float
    own: float

    def step(self, size: Array) -> float:
        """Return the px of a cell."""
        return max(1.0, (self.reach * float(np.max(size)) + self.room) / self.cells)

    def around(self, pixels: Array, place: Array, size: Array) -> Array:
        """Return what is around a place (2,) of a frame (h, w): (cells, cells), NaN outside the frame."""
        along = self._along(size)
        down, across = (self._within(place[k] + along, pixels.shape[1 - k]) for k in (1, 0))
        return np.where(down[:, None] & across, blurred(sample(pixels, place, self.step(size), self.cells)), np.nan)

    def slopes(self, image: Array, size: Array) -> Array:
        """Return the slopes (3, cells, cells) of what is around a thing along x and y, in count a px, and as the scene grows
        around its middle, in count; NaN at its edges.
        """
        slopes, along = np.full((3, *image.shape), np.nan), self._along(size)
        np.subtract(image[1:-1, 2:], image[1:-1, :-2], out=slopes[0, 1:-1, 1:-1])
        np.subtract(image[2:, 1:-1], image[:-2, 1:-1], out=slopes[1, 1:-1, 1:-1])
        slopes /= 2.0 * self.step(size)
        slopes[2] = slopes[0] * along + slopes[1] * along[:, None]
        return slopes

    def others(self, offset: Array, size: Array) -> Mask:
        """Return the cells that are not of a thing `offset` (2,) px from the middle."""
        along, own = self._along(size), self.own * size + HALO
        others: Mask = ((along - offset[1])[:, None] / own[1]) ** 2 + ((along - offset[0]) / own[0]) ** 2 >= 1.0
        return others

    def _along(self, size: Array) -> Array:
        """Return how far each cell is from the middle along a side, in px."""
        return self.step(size) * (np.arange(self.cells) - 0.5 * (self.cells - 1))

    @staticmethod
    def _within(at: Array, side: int) -> Mask:
        inside: Mask = (at >= 0.0) & (at <= side - 1.0)
        return inside


BESIDE = Grid(32, 3.0, 12.0, 1.2)
"""The grid over what is beside a thing where it was first seen."""


@frozen(eq=False)
class Shift:
    """How far a thing went in the scene, in px along two axes (2,): the columns of `axes` (2, 2); its standard deviations,
    infinite along an axis with less slope than noise; the variance of what it does not explain.
    """

    axes: Array
    along: Array
    deviation: Array
    rest: float


def by_slopes(slopes: Array, change: Array, step: float) -> Shift:
    """Return how far a thing went, as far as its scene did not, by slopes (3, n) and change (n,) of cells `step` px apart.

    The change is those slopes times the shift and the scene's growth, by least squares (Lucas, Kanade, An iterative image
    registration technique, IJCAI 1981).
    """
    G, r = slopes - slopes.mean(axis=1, keepdims=True), change - change.mean()  # a camera's level changes as a slope would
    grows = G[2] / max(float(np.hypot.reduce(G[2])), 1e-9)
    G, r = G[:2] - np.outer(G[:2] @ grows, grows), r - (r @ grows) * grows
    energy, axes = np.linalg.eigh(G @ G.T)
    along = axes.T @ (G @ r) / np.maximum(energy, 1e-9)
    rest = max(float(r @ r - energy @ (along * along)), 0.0) / len(r)
    signal = np.maximum(energy - len(change) * NOISE * 0.5 * rest / step**2, 1e-9)
    deviation = np.where(signal > 0.5 * energy, np.sqrt(ALIKE * rest / signal), np.inf)
    return Shift(axes, along * energy / signal, deviation, rest)


def gone(first: Array, pixels: Array, place: Array, origin: Array, size: Array) -> Array:
    """Return by how many px (2,) a thing has moved before its surroundings, from its `origin` to its `place`.

    What was around it (`first`), and is now, is seen from the thing, or from its origin, or from where they look most alike,
    whichever explains more. Along axes with less slope than noise, as before plain sky, the surroundings count as standing
    still.
    """
    shift, step = place - origin, BESIDE.step(size)
    slopes = BESIDE.slopes(first, size)
    known = np.isfinite(slopes).all(axis=0) & BESIDE.others(np.zeros(2), size)
    best, told = np.inf, np.asarray(shift)
    for start in (shift, np.zeros(2), shift + _nearest(first, known, pixels, place, step)):
        change = BESIDE.around(pixels, origin + start, size) - first
        seen = known & np.isfinite(change) & BESIDE.others(shift - start, size) & BESIDE.others(start - shift, size)
        if seen.sum() < FEWEST:
            continue
        more = by_slopes(slopes[:, seen], change[seen], step)
        if more.rest < best:
            sure, axes = (more.deviation < SURE) & (np.abs(more.along) < WIDE * step), more.axes
            best = more.rest
            told = np.asarray(axes @ np.where(sure, axes.T @ (shift - start) + more.along, axes.T @ shift))
    return told


def _nearest(first: Array, known: Mask, pixels: Array, place: Array, step: float) -> Array:
    """Return the offset (2,) in px from `place` at which the frame is most like what was around the thing first."""
    if known.sum() < FEWEST:
        return np.zeros(2)
    wide = blurred(sample(pixels, place, step, BESIDE.cells + 2 * FAR)).astype(np.float32)
    template = np.where(known, first, 0.0).astype(np.float32)
    likeness = opencv().matchTemplate(wide, template, opencv().TM_CCOEFF_NORMED, mask=known.astype(np.float32))
    row, column = np.unravel_index(np.argmax(np.where(np.isfinite(likeness), likeness, -1.0)), likeness.shape)
    return step * (np.array([column, row]) - FAR)
