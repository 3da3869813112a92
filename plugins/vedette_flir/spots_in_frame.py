"""Small targets in a whole frame: what is brighter or darker than all around it, and ends."""

from __future__ import annotations

from typing import Any

import numpy as np
from attrs import frozen

from vedette import Array
from vedette_flir.evidence import half_ring_spread, ring_spread
from vedette_flir.patches import median
from vedette_flir.sources.images import one_thread

LEVEL = 0.5
"""Part of its contrast above which a pixel belongs to a target."""

ROOM = 1.5
"""Side of the place in which a target must end, over the side of the structures that are taken out."""


FINEST = 15
"""Side in px from twice which on structures are looked at in a frame of half the resolution, and so on."""


@frozen(eq=False)
class Spots:
    """Targets found: centres (k, 2) and sizes (k, 2) in px, contrast over the spread around (k,), polarity (k,)."""

    place: Array
    size: Array
    clear: Array
    sign: Array


def spots(
    pixels: Array, polarity: float, sides: tuple[int, ...], least: float, most: int, *, before_edges: bool = False
) -> Spots:
    """Return the spots of a frame (h, w) that stand out by `least` times the spread around them, each once.

    For each side the grey opening of that side is taken out (top-hat), and the closing for dark ones; `polarity` 1: hot ones
    only, -1: dark ones, 0: both. A spot is a local
    maximum of the rest over its mean around, whose region above half its contrast ends nearby. The `most` clear ones of each
    side are looked at. With `before_edges` the spread is that of the calmest half around, so that a spot near a treeline
    or a cloud stands out, and what the image's edge cuts does not count.
    """
    candidates: list[tuple[float, float, Array, Array]] = []
    with one_thread() as cv2:
        grey = cv2.GaussianBlur(np.ascontiguousarray(pixels, dtype=np.float32), (0, 0), 0.8)
        for side in sides:
            coarse = max(side // FINEST, 1)
            if 2 * min(grey.shape) <= coarse:  # of such a frame nothing would be left
                continue
            seen = cv2.resize(grey, None, fx=1 / coarse, fy=1 / coarse, interpolation=cv2.INTER_AREA) if coarse > 1 else grey
            width = side // coarse // 2 * 2 + 1
            kernel = np.ones((width, width), np.uint8)
            for sign, operation in ((1.0, cv2.MORPH_TOPHAT), (-1.0, cv2.MORPH_BLACKHAT)):
                if sign * polarity < 0:
                    continue
                apart = cv2.morphologyEx(seen, operation, kernel)
                score = apart / (cv2.blur(apart, (3 * width, 3 * width)) + 1.0)
                peaks = np.flatnonzero((score == cv2.dilate(score, kernel)) & (score > 0.5 * least))
                best = peaks[np.argsort(-score.ravel()[peaks], kind="stable")[:most]]
                for at in best:
                    row, column = divmod(int(at), seen.shape[1])
                    spot = _measured(cv2, sign * seen, row, column, width, least, before_edges)
                    if spot is not None:
                        clear, centre, size = spot
                        where = coarse * centre + 0.5 * (coarse - 1)
                        candidates.append((clear, sign, _centroid(sign, grey, where, coarse * size), coarse * size))
    candidates.sort(key=lambda each: -each[0])
    places, sizes = (np.array([each[i] for each in candidates]).reshape(-1, 2) for i in (2, 3))
    first: list[int] = []
    for i in range(len(candidates)):
        if np.all(np.any(np.abs(places[i] - places[first]) > 0.5 * (sizes[i] + sizes[first]), axis=1)):
            first.append(i)
    return Spots(places[first], sizes[first], *(np.array([candidates[i][k] for i in first]) for k in (0, 1)))


def _measured(
    cv2: Any, grey: Array, row: int, column: int, side: int, least: float, before_edges: bool
) -> tuple[float, Array, Array] | None:
    """Return contrast over spread, centre and size of the hot spot at a pixel; None if it does not end or is not clear."""
    reach = int(ROOM * side)
    top, left = max(row - reach, 0), max(column - reach, 0)
    part = grey[top : row + reach + 1, left : column + reach + 1]
    peak = float(grey[row, column])
    half = part.size // 2  # a median of numpy's takes longer than all the rest here
    level = float(np.partition(part, half, axis=None)[half])
    above = (part > level + LEVEL * (peak - level)).view(np.uint8)
    if not above[row - top, column - left]:
        return None
    _, _, _, (x, y, w, h) = cv2.floodFill(above, None, (column - left, row - top), 2, flags=8)
    first = (x == 0 and (before_edges or left > 0)) or (y == 0 and (before_edges or top > 0))
    if first or x + w >= part.shape[1] or y + h >= part.shape[0]:
        return None
    size = np.array([w, h], dtype=float)
    centre = np.array([left + x + 0.5 * (w - 1), top + y + 0.5 * (h - 1)])
    middle, spread = (half_ring_spread if before_edges else ring_spread)(grey, centre, size + 1.0)
    clear = (peak - middle) / spread
    return None if clear < least else (clear, centre, size)


def _centroid(sign: float, grey: Array, centre: Array, size: Array) -> Array:
    """Return the centroid (2,) of what exceeds half the contrast of a hot spot, within its box and a pixel around it."""
    half = 0.5 * size + 1.0
    low, high = np.maximum(np.rint(centre - half), 0).astype(np.intp), np.rint(centre + half).astype(np.intp) + 1
    part = sign * grey[low[1] : high[1], low[0] : high[0]]
    edge = median(np.concatenate([part[0], part[-1], part[:, 0], part[:, -1]]))
    excess = np.maximum(part - (edge + LEVEL * (float(part.max()) - edge)), 0.0)
    if not excess.any():
        return centre
    along = [excess.sum(axis=0), excess.sum(axis=1)]
    found: Array = low + np.array([each @ np.arange(len(each)) for each in along]) / excess.sum()
    return found
