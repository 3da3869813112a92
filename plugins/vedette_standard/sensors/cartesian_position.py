"""A sensor that measures positions in the plane."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_standard.sensors.station import POSITION
from vedette_standard.sensors.viewed import ViewedSensor


@final
@frozen
class CartesianPosition(ViewedSensor):
    """z = position + v, v ~ N(0, sigma^2 I): a position in the tracker's own frame, whatever platform it comes from."""

    kind: ClassVar[str] = "cartesian_position"
    abbreviations: ClassVar[tuple[str, ...]] = ("position",)

    sigma: float = fields.quantity("m", "standard deviation per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)

    @property
    def observes(self) -> Space:
        return POSITION

    def noise(self, x: Array) -> Array:
        """Return R (2, 2)."""
        return self.sigma**2 * np.eye(2)
