"""What limits where a sensor sees: directions, areas, and a detection probability that varies over range and bearing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import final

import numpy as np
from attrs import frozen

from vedette import Array, Indices, Mask, fields
from vedette_standard.regions import Polygon

CIRCLE = 2 * math.pi
RAYS = 4096
"""Directions in each sector over which the size of a view with corners is summed."""


@final
@frozen
class Sector:
    """Directions from `low` round to `high`, as bearings are counted: from the sensor's heading, from +x towards +y."""

    low: float = fields.quantity("rad", "bearing at which it begins")
    high: float = fields.quantity("rad", "bearing at which it ends, above `low`")

    def __attrs_post_init__(self) -> None:
        if not 0 < self.high - self.low <= CIRCLE * (1 + 1e-12):
            raise ValueError(f"high: must be > low, by one turn at most, got {self.high:g} rad after {self.low:g} rad")


def directed(sectors: Sequence[Sector], bearing: Array) -> Mask:
    """Return whether bearings (*b) lie in one of some sectors (*b); where there are none, all do."""
    if not sectors:
        return np.ones(bearing.shape, dtype=bool)
    return np.any([np.mod(bearing - sector.low, CIRCLE) <= sector.high - sector.low for sector in sectors], axis=0)


def width(sectors: Sequence[Sector]) -> float:
    """Return the angle that some sectors cover together, in rad; where there are none, the whole circle."""
    return sum(sector.high - sector.low for sector in sectors) if sectors else CIRCLE


def check_apart(sectors: Sequence[Sector]) -> None:
    """Raise ValueError if two sectors overlap, as their clutter would be counted twice."""
    for i, one in enumerate(sectors):
        for other in sectors[:i]:
            after, before = (other.low - one.low) % CIRCLE, (one.low - other.low) % CIRCLE
            if after < one.high - one.low - 1e-12 or before < other.high - other.low - 1e-12:
                raise ValueError(f"sectors[{i}]: must not overlap another one")


def _ascending(numbers: Array) -> str | None:
    return None if len(numbers) and np.all(np.diff(numbers) > 0) else "must ascend"


def _probabilities(numbers: Array) -> str | None:
    return None if np.all((numbers >= 0) & (numbers <= 1)) else "must be probabilities, from 0 to 1"


@final
@frozen
class Detection:
    """The detection probability by range and bearing, a table of cells within each of which it is the same.

    A row of `probability` holds from its range to the next one's, the last row to any range; a column from its bearing round
    to the next one's, the last on to the first. What is nearer than the first range counts as in the first row.
    """

    probability: Array = fields.array("1", "a row a range, a column a bearing", ndim=2, check=_probabilities)
    ranges: Array = fields.array("m", "where each row begins", ndim=1, default=np.zeros(1), check=_ascending)
    bearings: Array = fields.array("rad", "where each column begins", ndim=1, default=np.zeros(1), check=_ascending)

    def __attrs_post_init__(self) -> None:
        wanted = (len(self.ranges), len(self.bearings))
        if self.probability.shape != wanted:
            got = " x ".join(map(str, self.probability.shape))
            raise ValueError(f"probability: must be {wanted[0]} x {wanted[1]}, a row a range, a column a bearing, got {got}")
        if self.bearings[-1] - self.bearings[0] >= CIRCLE:
            raise ValueError("bearings: must lie within one turn")

    def cells(self, r: Array, bearing: Array) -> tuple[Indices, Indices]:
        """Return the row and the column of places at ranges and bearings (*b), (*b) each."""
        row = np.clip(np.searchsorted(self.ranges, r, side="right") - 1, 0, None)
        turned = self.bearings[0] + np.mod(bearing - self.bearings[0], CIRCLE)
        return row, np.clip(np.searchsorted(self.bearings, turned, side="right") - 1, 0, None)

    def at(self, r: Array, bearing: Array) -> Array:
        """Return the probability at ranges and bearings: (*b), (*b) -> (*b)."""
        return self.probability[self.cells(r, bearing)]


def size(
    sectors: Sequence[Sector], polygons: Sequence[Polygon], boxes: Sequence[Polygon],
    near: float, far: float | None, place: Array, heading: float, power: int,
) -> float:  # fmt: skip
    """Return the integral of r^(power-1) dr db over a view: its area (power 2), or its extent in range and bearing (1).

    The view lies in one of the `polygons` and in all `boxes`, `near` to `far` from `place`. On each of many rays from there,
    the distances at which it enters and leaves are exact.
    """
    lines = [shape.corners - place for shape in (*polygons, *boxes)]
    reach = max((float(np.max(np.hypot(*corners.T))) for corners in lines), default=math.inf)
    end = reach if far is None else min(far, reach)
    start = np.concatenate(lines)
    side = np.concatenate([np.roll(corners, -1, axis=0) - corners for corners in lines])
    total = 0.0
    for sector in sectors or (Sector(0.0, CIRCLE),):
        step = (sector.high - sector.low) / RAYS
        angle = heading + sector.low + (np.arange(RAYS) + 0.5) * step
        ray = np.stack([np.cos(angle), np.sin(angle)], axis=-1)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = ray[..., 0] * side[:, 1] - ray[..., 1] * side[:, 0]
            r = (start[:, 0] * side[:, 1] - start[:, 1] * side[:, 0]) / slope
        r = np.clip(np.where(np.isfinite(r), r, near), near, max(end, near))
        knots = np.sort(np.concatenate([np.full((RAYS, 1), near), r, np.full((RAYS, 1), max(end, near))], axis=1), axis=1)
        spot = place + 0.5 * (knots[:, 1:] + knots[:, :-1])[..., None] * ray
        inside = np.all([box.holds(spot) for box in boxes], axis=0) if boxes else np.ones(spot.shape[:-1], dtype=bool)
        if polygons:
            inside &= np.any([shape.holds(spot) for shape in polygons], axis=0)
        total += step / power * float(np.sum((knots[:, 1:] ** power - knots[:, :-1] ** power) * inside))
    return total
