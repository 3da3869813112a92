"""A sensor that measures directions: a camera, a passive sonar, a direction finder."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, Twin, fields
from vedette_standard.sensors.geometry import polar_slope, ranges_and_bearings
from vedette_standard.sensors.placed import PlacedSensor
from vedette_standard.sensors.station import POSITION
from vedette_standard.sensors.view import width

_BEARING = Space.of(bearing="rad mod 2pi")


@final
@frozen
class BearingOnly(PlacedSensor):
    """z = b + v, v ~ N(0, sigma_bearing^2), b = atan2(dy, dx) - heading, from +x towards +y.

    One bearing gives no position, so it starts no track; the position is observable once the platform manoeuvres against a
    target that does not. Clutter is uniform over the circle, or over the sectors in view.
    Nardone, Aidala, Observability Criteria for Bearings-Only Target Motion Analysis, IEEE T-AES 17, 1981.

    >>> sensor = BearingOnly(sigma_bearing=0.02, x=10.0, y=20.0, heading=0.5, clutter_per_scan=3.0)
    >>> x = np.array([40.0, 60.0])  # 30 and 40 m away, so 50 m
    >>> np.allclose(sensor.measure(x), np.arctan2(40.0, 30.0) - 0.5), sensor.jacobian(x).round(9).tolist()
    (True, [[-0.016, 0.012]])
    >>> sensor.noise(x).round(9).tolist(), np.allclose(sensor.clutter(np.zeros((1, 1))), 3.0 / (2.0 * np.pi))
    ([[0.0004]], True)
    """

    kind: ClassVar[str] = "bearing_only"
    observes: ClassVar[Space] = POSITION
    measurement: ClassVar[Space] = _BEARING

    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)

    def _unbounded(self) -> str:
        return ""

    def _summed(self) -> int:
        return 0

    @property
    def twin(self) -> Twin | None:
        return self._twin(self.sigma_bearing**2)

    def measure(self, x: Array) -> Array:
        return _BEARING.canonical(ranges_and_bearings(x, self._pose)[..., 1:])

    def jacobian(self, x: Array) -> Array:
        return polar_slope(x, self._pose)[..., 1:, :]

    def noise(self, x: Array) -> Array:
        return np.array([[self.sigma_bearing**2]])

    def clutter(self, z: Array) -> Array:
        """Return the clutter density: () in 1/rad."""
        return np.asarray(self.clutter_per_scan / width(self.sectors))
