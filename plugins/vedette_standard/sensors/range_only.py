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

    >>> from vedette_standard.sensors.view import Sector
    >>> sensor = RangeOnly(sigma_range=6.0, x=10.0, y=20.0, min_range=30.0, max_range=100.0, clutter_per_scan=3.0)
    >>> x = np.array([40.0, 60.0])  # 30 and 40 m away, so 50 m
    >>> sensor.measure(x).tolist(), sensor.jacobian(x).round(9).tolist(), sensor.noise(x).tolist()
    ([50.0], [[0.6, 0.8]], [[36.0]])
    >>> z = np.array([[50.0], [80.0]])
    >>> np.allclose(sensor.clutter(z), 2.0 * 3.0 * z[:, 0] / (100.0**2 - 30.0**2))
    True
    >>> evenly = RangeOnly(6.0, min_range=30.0, max_range=100.0, clutter_per_scan=3.0, clutter_uniform_over="range")
    >>> np.allclose(evenly.clutter(z), 3.0 / 70.0)
    True
    >>> dense = RangeOnly(6.0, clutter_density=1e-4, sectors=(Sector(0.0, 0.5),))
    >>> np.allclose(dense.clutter(z), 1e-4 * 0.5 * z[:, 0])
    True
    >>> sensor.detects(np.array([[40.0, 60.0], [10.0, 21.0], [10.0, 121.0]])).tolist()
    [1.0, 0.0, 0.0]
    """

    kind: ClassVar[str] = "range_only"
    observes: ClassVar[Space] = POSITION
    measurement: ClassVar[Space] = _RANGE

    sigma_range: float = fields.quantity("m", "standard deviation of the range", above=0)
    clutter_density: float = fields.quantity(
        "1/m^2", "false returns per scan and area: 2 pi r times as many per m at range r", default=0.0, at_least=0
    )

    @property
    def twin(self) -> Twin | None:
        return self._twin(self.sigma_range**2)

    def measure(self, x: Array) -> Array:
        return ranges_and_bearings(x, self._pose)[..., :1]

    def jacobian(self, x: Array) -> Array:
        return polar_slope(x, self._pose)[..., :1, :]

    def noise(self, x: Array) -> Array:
        return np.array([[self.sigma_range**2]])

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: (*b, k, 1) -> (*b, k) in 1/m, or () if it is the same everywhere."""
        density = per_range(self, z[..., 0], 2)
        return density * width(self.sectors) / CIRCLE if self.clutter_density > 0 else density

    def _unbounded(self) -> str:
        return "max_range" if self.max_range is None else ""

    def _summed(self) -> int:
        return 0
