"""A sensor that measures distances: a ranging beacon, an active sonar with one hydrophone."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, Twin, fields
from vedette_standard.sensors.clutter import per_range
from vedette_standard.sensors.geometry import polar_slope, ranges_and_bearings
from vedette_standard.sensors.placed import RangingSensor
from vedette_standard.sensors.station import POSITION
from vedette_standard.sensors.view import CIRCLE, width

_RANGE = Space.of(range="m")


@final
@frozen
class RangeOnly(RangingSensor):
    """z = r + v, v ~ N(0, sigma_range^2), r = sqrt(dx^2 + dy^2).

    One range gives no position, so it starts no track. Clutter is uniform over the area from `min_range` to `max_range`,
    hence of density 2 n r / (max^2 - min^2) in z, or over range: n / (max - min); polygons do not shape it.
    Song, Observability of Target Tracking with Range-Only Measurements, IEEE J. Oceanic Engineering 24, 1999.
    """

    kind: ClassVar[str] = "range_only"

    sigma_range: float = fields.quantity("m", "standard deviation of the range", above=0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)

    @property
    def observes(self) -> Space:
        return POSITION

    @property
    def measurement(self) -> Space:
        return _RANGE

    @property
    def twin(self) -> Twin | None:
        """Its compiled twin."""
        return self._twin(self.sigma_range**2)

    def measure(self, x: Array) -> Array:
        """Return the expected measurement: (*b, 2) -> (*b, 1)."""
        return ranges_and_bearings(x, self._pose)[..., :1]

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, 2) -> (*b, 1, 2)."""
        return polar_slope(x, self._pose)[..., :1, :]

    def noise(self, x: Array) -> Array:
        """Return R (1, 1)."""
        return np.array([[self.sigma_range**2]])

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 1) -> (*b, k) in 1/m, or () if it is the same everywhere."""
        density = per_range(self, z[..., 0], 2)
        return density * width(self.sectors) / CIRCLE if self.clutter_density > 0 else density

    def _unbounded(self) -> str:
        return "max_range" if self.max_range is None else ""

    def _summed(self) -> int:
        return 0
