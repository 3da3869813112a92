"""Areas in the plane: what a sensor sees, where targets appear, where they survive."""

from __future__ import annotations

from collections.abc import Sequence
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Mask, Space, fields

PLANE = Space.of(x="m", y="m")


def _corners(numbers: Array) -> str | None:
    if numbers.shape[1] != 2 or len(numbers) < 3:
        return f"must be three corners or more, each x and y, got {len(numbers)} x {numbers.shape[1]} numbers"
    x, y = numbers.T
    if abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) <= 1e-12 * float(np.max(np.ptp(numbers, axis=0))) ** 2:
        return "must enclose an area, got corners on one line"
    return None


@final
@frozen
class Polygon:
    """An area in the tracker's frame, within straight lines from corner to corner and back to the first.

    >>> kite = np.array([[0.0, -40.0], [30.0, 20.0], [5.0, 0.0], [-20.0, 10.0]])
    >>> spots = np.array([[0.0, -30.0], [20.0, 5.0], [5.0, 2.0], [-15.0, 5.0], [12.0, -20.0]])
    >>> [Polygon(corners).holds(spots).tolist() for corners in (kite, kite[::-1])]  # its corners may go either way
    [[True, True, False, True, False], [True, True, False, True, False]]
    """

    corners: Array = fields.array("m", "x and y of each corner, in order around the area", ndim=2, check=_corners)

    def holds(self, spot: Array) -> Mask:
        """Return whether places lie inside, (*b, 2) -> (*b): a ray from them crosses an odd number of its sides."""
        x, y = spot[..., 0, None], spot[..., 1, None]
        (x1, y1), (x2, y2) = self.corners.T, np.roll(self.corners, -1, axis=0).T
        spans = (y1 <= y) != (y2 <= y)
        with np.errstate(divide="ignore", invalid="ignore"):
            beyond = x < x1 + (y - y1) * (x2 - x1) / (y2 - y1)
        return np.sum(spans & beyond, axis=-1) % 2 == 1


def held(areas: Sequence[Polygon], spot: Array) -> Mask:
    """Return whether places (*b, 2) lie in one of some areas (*b); where there are no areas, everywhere does."""
    if not areas:
        return np.ones(spot.shape[:-1], dtype=bool)
    return np.any([area.holds(spot) for area in areas], axis=0)
