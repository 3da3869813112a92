"""Blobs: maxima of the determinant of the Hessian over place and scale."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import Array
from vedette_marine.opencv import opencv

Image = NDArray[np.float32]

BLOCK = 16
"""Side in px of the blocks that make up the searched parts of a picture."""


@frozen(eq=False)
class Blobs:
    """Centres (k, 2), column and row in px, scales (k,) in px, and determinants (k,) of a picture from 0 to 1."""

    at: Array
    scale: Array
    strength: Array


def hessian_exact(image: Image, sigma: float) -> tuple[Image, Image, Image]:
    """Return second derivatives xx, yy, xy of the picture smoothed by a Gaussian of `sigma` px, by its derivatives."""
    cv2 = opencv()
    radius = max(1, int(4.0 * sigma + 0.5))
    t = np.arange(-radius, radius + 1)
    g = np.exp(-0.5 * (t / sigma) ** 2)
    g /= g.sum()
    first, second = t / sigma**2 * g, (t**2 / sigma**4 - 1 / sigma**2) * g
    filtered = [
        cv2.sepFilter2D(image, cv2.CV_32F, kx, ky, borderType=cv2.BORDER_REFLECT)
        for kx, ky in ((second, g), (g, second), (first, first))
    ]
    return filtered[0], filtered[1], filtered[2]


def hessian_sobel(smooth: Image) -> tuple[Image, Image, Image]:
    """Return second derivatives xx, yy, xy of a smooth picture by 3 x 3 masks."""
    cv2 = opencv()
    kinds = ((2, 0, 0.25), (0, 2, 0.25), (1, 1, 0.25))
    derivatives = [cv2.Sobel(smooth, cv2.CV_32F, dx, dy, ksize=3, scale=scale) for dx, dy, scale in kinds]
    return derivatives[0], derivatives[1], derivatives[2]


def determinants(image: Image, scales: Sequence[float], exact: bool) -> Iterator[Image]:
    """Yield sigma^4 (Lxx Lyy - Lxy^2) for each of the rising `scales` in px; 0 where the picture is not bright.

    `exact` uses sampled derivatives of the Gaussian; otherwise it smooths further from scale to scale, with 3 x 3 masks.
    """
    cv2 = opencv()
    smooth, before = image, 0.0
    for sigma in scales:
        if exact:
            xx, yy, xy = hessian_exact(image, sigma)
        else:
            smooth = cv2.GaussianBlur(smooth, (0, 0), (sigma**2 - before**2) ** 0.5, borderType=cv2.BORDER_REFLECT)
            xx, yy, xy = hessian_sobel(smooth)
        before = sigma
        determinant: Any = cv2.multiply(xx, yy, scale=sigma**4)
        determinant -= cv2.multiply(xy, xy, scale=sigma**4)
        determinant[xx + yy > 0] = 0
        yield determinant


def find_blobs(image: Image, scales: Sequence[float], threshold: float, exact: bool = False) -> Blobs:
    """Find maxima of at least `threshold` among their 26 neighbours in place and scale; a parabola refines the place.

    Only the surroundings of pixels that are not 0 are searched: most of a radar picture is black.
    """
    boxes, owner = surroundings(image, 5.0 * scales[-1])
    blobs = [Blobs(np.zeros((0, 2)), np.zeros(0), np.zeros(0))]
    for number, (rows, columns) in enumerate(boxes, start=1):
        part = _find(np.ascontiguousarray(image[rows, columns]), scales, threshold, exact)
        at = part.at + [columns.start, rows.start]
        inside = owner[tuple(np.rint(at[:, ::-1]).astype(np.intp).T // BLOCK)] == number
        blobs.append(Blobs(at[inside], part.scale[inside], part.strength[inside]))
    return Blobs(*(np.concatenate([getattr(each, name) for each in blobs]) for name in ("at", "scale", "strength")))


def surroundings(image: Image, reach: float) -> tuple[list[tuple[slice, slice]], NDArray[np.int32]]:
    """Return boxes, rows and columns, around pixels that are not 0, at least `reach` px wider on each side; and which box,
    from 1 on, a block of the picture belongs to. There is one box of everything where that is not much more.
    """
    cv2 = opencv()
    h, w = image.shape
    grid = (-(-h // BLOCK), -(-w // BLOCK))
    padded = np.zeros((grid[0] * BLOCK, grid[1] * BLOCK), dtype=bool)
    padded[:h, :w] = image != 0
    held = padded.reshape(grid[0], BLOCK, grid[1], BLOCK).any(axis=(1, 3)).astype(np.uint8)
    side = 2 * int(np.ceil(reach / BLOCK)) + 1
    count, owner, boxes, _ = cv2.connectedComponentsWithStats(cv2.dilate(held, np.ones((side, side), dtype=np.uint8)))
    if 2 * int(np.sum(boxes[1:, 2] * boxes[1:, 3])) > owner.size:
        return [(slice(0, h), slice(0, w))], np.ones_like(owner)
    x, y, width, height = BLOCK * boxes[1:, :4].T
    return [(slice(y[i], min(y[i] + height[i], h)), slice(x[i], min(x[i] + width[i], w))) for i in range(count - 1)], owner


def _find(image: Image, scales: Sequence[float], threshold: float, exact: bool) -> Blobs:
    """Find the blobs of a whole picture."""
    cv2 = opencv()
    stack = list(determinants(image, scales, exact))
    box = np.ones((3, 3), dtype=np.uint8)
    tops = [cv2.dilate(layer, box) for layer in stack]
    at, scale, strength = [], [], []
    for k, layer in enumerate(stack):
        rows, columns = np.nonzero((layer >= threshold) & (layer == tops[k]))
        for other in (k - 1, k + 1):
            if 0 <= other < len(stack):
                kept = layer[rows, columns] >= tops[other][rows, columns]
                rows, columns = rows[kept], columns[kept]
        at.append(
            np.stack([columns + _parabola(layer, rows, columns, 1), rows + _parabola(layer, rows, columns, 0)], axis=-1)
        )
        scale.append(np.full(len(rows), scales[k]))
        strength.append(layer[rows, columns].astype(float))
    return Blobs(np.concatenate(at), np.concatenate(scale), np.concatenate(strength))


def _parabola(image: Image, rows: NDArray[np.intp], columns: NDArray[np.intp], axis: int) -> Array:
    """Return how far, at most half a pixel, the vertex of a parabola through three neighbours along `axis` is off."""
    h, w = image.shape
    step = np.array([1, 0]) if axis == 0 else np.array([0, 1])
    low = image[np.maximum(rows - step[0], 0), np.maximum(columns - step[1], 0)].astype(float)
    high = image[np.minimum(rows + step[0], h - 1), np.minimum(columns + step[1], w - 1)].astype(float)
    bend = low + high - 2.0 * image[rows, columns]
    shift: Array = np.where(bend < 0, 0.5 * (low - high) / np.where(bend < 0, bend, 1.0), 0.0)
    return np.clip(shift, -0.5, 0.5)
