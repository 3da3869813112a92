"""Echoes that are no ships: spokes of radar beacons and rain."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vedette import Array, Mask
from vedette_marine.opencv import opencv
from vedette_marine.picture.colours import Bytes


def spokes(above: Mask, right_ahead: tuple[Array, Array], width: float, share: float, nearest: float) -> Mask:
    """Which pixels lie on a spoke: a narrow sector of bearings, `width` rad wide, in which a far greater part of the ranges
    beyond `nearest` echoes than beside it. A radar beacon (RACON) draws one, of dashes in Morse code.

    `above` (h, w): echoes; right_ahead: where the pixels are, in m from the antenna. A sector counts if at least `share` of
    its range cells hold an echo and the sectors two and three widths beside it have less than half of that.
    """
    right, ahead = right_ahead
    rows, columns = np.nonzero(above)
    x, y = right[columns], ahead[rows]
    r = np.hypot(x, y)
    far = r > nearest
    if not far.any():
        return np.zeros(above.shape, dtype=bool)
    sectors = max(8, round(2 * np.pi / width))
    sector = np.floor((np.arctan2(x[far], y[far]) / (2 * np.pi) % 1.0) * sectors).astype(np.intp) % sectors
    cell = abs(float(right[1] - right[0])) * 2.0
    cells = max(1, int((min(np.max(np.abs(right)), np.max(np.abs(ahead))) - nearest) / cell))
    ring = np.minimum(((r[far] - nearest) / cell).astype(np.intp), cells - 1)
    held = np.zeros((sectors, cells), dtype=bool)
    held[sector, ring] = True
    part = np.mean(held, axis=1)
    beside = np.max([np.roll(part, shift) for shift in (-3, -2, 2, 3)], axis=0)
    found = (part >= share) & (beside < 0.5 * part)
    found = found | np.roll(found, 1) & (part > beside) | np.roll(found, -1) & (part > beside)
    mask = np.zeros(above.shape, dtype=bool)
    mask[rows[far], columns[far]] = found[sector]
    return mask


def rain(above: Bytes, side: int, share: float) -> Mask:
    """Where more than `share` of the pixels in a square of `side` px echo: rain, or land; `above` (h, w) is 0 or 1."""
    cv2 = opencv()
    density = cv2.boxFilter(above, cv2.CV_32F, (side, side), borderType=cv2.BORDER_CONSTANT)
    found: NDArray[np.bool_] = density > share
    return found
