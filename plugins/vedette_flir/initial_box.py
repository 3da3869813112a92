"""Find the target within a hand-drawn box: its centre, its size and its polarity."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_flir.patches import blurred, sample
from vedette_flir.sources.images import one_thread

LEVELS = np.linspace(0.15, 0.85, 15)
"""Thresholds, as fractions of the range from the box's median to its extreme."""

BEYOND = 0.6
"""Fraction of the box's side, from its centre: what reaches farther by more than a pixel is background."""

CENTRED = 0.25
"""Fraction of the box's side: standard deviation of a target's position in its box."""

SMALLEST = 0.45
"""Fraction of the box's side: least size of a target, as what stands out of a dim one may be a pixel or two."""


@frozen(eq=False)
class Found:
    """Offset from the box's centre (2,) and size (2,), both x and y in px, and the polarity: 1 hot, -1 cold."""

    offset: Array
    size: Array
    sign: float


def target_in(pixels: Array, centre: Array, box: Array) -> Found:
    """Find the connected region, above or below a threshold, that stands out most and ends within the box.

    Its score is contrast to the ring around it, times the root of its area, times a Gaussian of its offset. A box that is
    off by a tenth of its side, or too large, gives the same target; background extends beyond the box.
    """
    half = np.maximum(box, 6.0)
    step = max(1.0, float(half.max()) / 40.0)
    cells = int(np.ceil(2.0 * half.max() / step)) // 4 * 4 + 4
    image = blurred(sample(pixels, centre, step, cells))
    u = step * (np.arange(cells) - 0.5 * (cells - 1))
    inside = np.abs(u) <= 0.5 * np.maximum(box, 2.0 * step)[:, None]
    within = image[np.ix_(inside[1], inside[0])]
    middle, edge = float(np.median(within)), float(np.median(image))
    best, found = -np.inf, Found(np.zeros(2), 0.7 * box, 1.0 if middle >= edge else -1.0)
    with one_thread() as cv2:
        for sign, most in ((1.0, within.max() - middle), (-1.0, middle - within.min())):
            for level in sign * middle + LEVELS * float(most):
                score, offset, size = _standing_out(cv2, sign * image, level, u, box)
                if score > best:
                    best, found = score, Found(offset, size, sign)
    return Found(found.offset, np.clip(found.size, SMALLEST * box, box), found.sign)


def _standing_out(cv2: Any, image: Array, level: float, u: Array, box: Array) -> tuple[float, Array, Array]:
    """Return the best region of `image` above `level`: its score (-inf if there is none), offset and size."""
    best: tuple[float, Array, Array] = (-np.inf, np.zeros(2), box)
    _, labels, boxes, _ = cv2.connectedComponentsWithStats((image > level).view(np.uint8), connectivity=4)
    half = 0.5 * (u[1] - u[0])
    for number, (x, y, w, h, area) in enumerate(boxes[1:], 1):
        ends = np.array([[u[x] - half, u[x + w - 1] + half], [u[y] - half, u[y + h - 1] + half]])
        if np.any(np.max(np.abs(ends), axis=1) > BEYOND * box + 1.0):
            continue
        near = np.s_[max(y - 2, 0) : y + h + 2, max(x - 2, 0) : x + w + 2]
        part, seen = labels[near] == number, image[near]
        excess = part * (seen - level)
        shares = excess / excess.sum()
        offset = np.array([shares.sum(axis=k) @ u[along] for k, along in ((0, near[1]), (1, near[0]))])
        beside = cv2.dilate(part.view(np.uint8), cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3)), iterations=2) - part
        gap = float(seen[part].mean() - np.median(seen[beside > 0]))
        score = gap * np.sqrt(area) * np.exp(-0.5 * np.sum((offset / box) ** 2) / CENTRED**2)
        if score > best[0]:
            best = (score, offset, ends[:, 1] - ends[:, 0])
    return best
