"""Find the target within a hand-drawn box: its centre, its size and its polarity."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array, Mask
from vedette_flir.patches import blurred, sample

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

    Its score is contrast to the ring around it over noise, times the root of its area, times a Gaussian of its offset. A
    box that is off by a tenth of its side, or too large, gives the same target; background extends beyond the box.
    """
    from scipy import ndimage

    half = np.maximum(box, 6.0)
    step = max(1.0, float(half.max()) / 40.0)
    cells = int(np.ceil(2.0 * half.max() / step)) // 4 * 4 + 4
    image = blurred(sample(pixels, centre, step, cells))
    u = step * (np.arange(cells) - 0.5 * (cells - 1))
    noise = 0.5 + 1.48 * float(np.median(np.abs(image - ndimage.median_filter(image, 5))))
    inside = np.abs(u) <= 0.5 * np.maximum(box, 2.0 * step)[:, None]
    within = image[np.ix_(inside[1], inside[0])]
    middle, edge = float(np.median(within)), float(np.median(image))
    best, found = -np.inf, Found(np.zeros(2), 0.7 * box, 1.0 if middle >= edge else -1.0)
    for sign, most in ((1.0, within.max() - middle), (-1.0, middle - within.min())):
        for level in sign * middle + LEVELS * float(most):
            weight, offset, size = _standing_out(sign * image, level, u, box)
            if weight / noise > best:
                best, found = weight / noise, Found(offset, size, sign)
    return Found(found.offset, np.clip(found.size, SMALLEST * box, box), found.sign)


def _standing_out(image: Array, level: float, u: Array, box: Array) -> tuple[float, Array, Array]:
    """Return the best region of `image` above `level`: its score (-inf if there is none), offset and size."""
    from scipy import ndimage

    best: tuple[float, Array, Array] = (-np.inf, np.zeros(2), box)
    labels, _ = ndimage.label(image > level)
    half = 0.5 * (u[1] - u[0])
    for number, place in enumerate(filter(None, ndimage.find_objects(labels)), 1):
        ends = np.array([[u[along.start] - half, u[along.stop - 1] + half] for along in place[::-1]])
        if np.any(np.max(np.abs(ends), axis=1) > BEYOND * box + 1.0):
            continue
        part = labels[place] == number
        excess = part * (image[place] - level)
        shares = excess / excess.sum()
        offset = np.array([(shares.sum(axis=0) * u[place[1]]).sum(), (shares.sum(axis=1) * u[place[0]]).sum()])
        near = tuple(slice(max(along.start - 2, 0), along.stop + 2) for along in place)
        gap = float(image[place][part].mean() - np.median(image[near][_ring(labels[near] == number)]))
        weight = gap * np.sqrt(part.sum()) * np.exp(-0.5 * np.sum((offset / box) ** 2) / CENTRED**2)
        if weight > best[0]:
            best = (weight, offset, ends[:, 1] - ends[:, 0])
    return best


def _ring(part: Mask) -> Mask:
    """Return what lies within two cells of a region."""
    from scipy import ndimage

    ring: Mask = ndimage.binary_dilation(part, iterations=2) & ~part
    return ring
