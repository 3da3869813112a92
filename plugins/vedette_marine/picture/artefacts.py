"""Echoes that are not ships: spokes of radar beacons, and rain."""

from __future__ import annotations

import numpy as np

from vedette import Array, Mask
from vedette_marine.opencv import opencv
from vedette_marine.picture.colours import Bytes


def spokes(above: Mask, right_ahead: tuple[Array, Array], width: float, length: float, nearest: float) -> Mask:
    """Find the pixels that lie on a spoke: a narrow sector of bearings that echoes over at least `length` m of its ranges
    beyond `nearest`, where the sectors four and five places beside it do so over less than half as much. A beacon (RACON)
    draws one, made of Morse dashes, a few beams wide.

    `above` (h, w): echoes; right_ahead: positions of the pixels in m from the antenna; `width`: of a sector in rad.
    """
    right, ahead = right_ahead
    rows, columns = np.nonzero(above)
    x, y = right[columns], ahead[rows]
    r = np.hypot(x, y)
    far = r > nearest
    mask = np.zeros(above.shape, dtype=bool)
    if not far.any():
        return mask
    sectors = max(16, round(2 * np.pi / width))
    sector = np.floor((np.arctan2(x[far], y[far]) / (2 * np.pi) % 1.0) * sectors).astype(np.intp) % sectors
    cell = 2.0 * abs(float(right[1] - right[0]))
    ring = ((r[far] - nearest) / cell).astype(np.intp)
    held = np.zeros((sectors, int(ring.max()) + 1), dtype=bool)
    held[sector, ring] = True
    echoing = cell * np.sum(held, axis=1)
    beside = np.max([np.roll(echoing, shift) for shift in (-5, -4, 4, 5)], axis=0)
    rings = (echoing >= length) & (beside < 0.5 * echoing)
    near = rings | np.any([np.roll(rings, shift) for shift in (-2, -1, 1, 2)], axis=0) & (echoing >= 0.2 * length)
    mask[rows[far], columns[far]] = near[sector]
    return mask


def rain(above: Bytes, side: int, share: float) -> Mask:
    """Find where more than `share` of the pixels in a square of `side` px echo: rain, or land; `above` (h, w) is 0 or 1."""
    cv2 = opencv()
    density = cv2.boxFilter(above, cv2.CV_32F, (side, side), borderType=cv2.BORDER_CONSTANT)
    return density > share
