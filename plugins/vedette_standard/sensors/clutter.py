"""Clutter of a sensor that sees around itself: its false returns, stated by their number or by their density."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np

from vedette import Array, fields
from vedette_standard.regions import Polygon
from vedette_standard.sensors.view import CIRCLE, Sector, width


class Around(Protocol):
    """The parameters that say how clutter spreads around a sensor."""

    @property
    def min_range(self) -> float: ...

    @property
    def max_range(self) -> float | None: ...

    @property
    def clutter_density(self) -> float: ...

    @property
    def clutter_per_scan(self) -> float: ...

    @property
    def clutter_uniform_over(self) -> str: ...

    @property
    def sectors(self) -> Sequence[Sector]: ...

    @property
    def polygons(self) -> Sequence[Polygon]: ...

    @property
    def _size(self) -> float: ...


def uniform_over() -> Any:
    """Declare how a stated number of false returns spreads."""
    return fields.choice(
        "what `clutter_per_scan` spreads over evenly: the area in view, or range and direction, as a receiver's cells do",
        ("area", "range"),
        default="area",
    )


def check_stated_once(density: float, number: float) -> None:
    """Raise ValueError if clutter is stated twice."""
    if density > 0 and number > 0:
        raise ValueError("clutter_per_scan: give either this or clutter_density, not both")


def per_range(sensor: Around, r: Array, power: int) -> Array:
    """Return the expected false returns per scan and m of range at ranges r (*b), in the plane (power 2) or in space (3).

    It is that of a view all around: in sectors there are as many if the number is stated, and fewer of a density.
    Beyond the limits, where noise may put a return, it is as at the limit. () where it is the same at all ranges.
    """
    number, near = sensor.clutter_per_scan, sensor.min_range
    if sensor.clutter_density > 0:
        within = np.clip(r, near, sensor.max_range)
        return sensor.clutter_density * (power - 1) * CIRCLE * within ** (power - 1)
    if number == 0 or sensor.max_range is None:
        return np.asarray(0.0)
    if sensor.clutter_uniform_over == "range":
        return np.asarray(number / (sensor.max_range - near))
    extent = (sensor.max_range**power - near**power) / power
    return number / extent * np.clip(r, near, sensor.max_range) ** (power - 1)


def per_direction(sensor: Around, r: Array, power: int) -> Array:
    """Return the expected false returns per scan, m of range and rad of bearing at ranges r (*b), as `per_range`."""
    if sensor.clutter_density > 0:
        return per_range(sensor, r, power) / CIRCLE
    if not sensor.polygons or sensor.clutter_per_scan == 0:
        return per_range(sensor, r, power) / width(sensor.sectors)
    number = sensor.clutter_per_scan / sensor._size
    if sensor.clutter_uniform_over == "range":
        return np.asarray(number)
    return number * np.clip(r, sensor.min_range, sensor.max_range)
