"""A sensor that measures positions and velocities in the plane: a satellite receiver, AIS."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_standard.sensors.viewed import ViewedSensor

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@final
@frozen
class PositionVelocity(ViewedSensor):
    """z = (x, y, vx, vy) + v, v ~ N(0, diag(sigma^2, sigma^2, sigma_speed^2, sigma_speed^2)), in the tracker's own frame.

    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.2.

    >>> from vedette.sampling import Bounds
    >>> view = {"x": Bounds(0.0, 50.0), "y": Bounds(-10.0, 10.0), "vx": Bounds(-5.0, 5.0), "vy": Bounds(-2.0, 2.0)}
    >>> sensor = PositionVelocity(6.0, 0.5, detection_probability=0.8, clutter_per_scan=3.0, view=view)
    >>> x = np.array([[40.0, 6.0, 4.0, -1.0], [60.0, 6.0, 4.0, -1.0], [40.0, 6.0, 4.0, -3.0]])
    >>> sensor.measure(x[0]).tolist(), np.diag(sensor.noise(x)).tolist(), sensor.detects(x).tolist()
    ([40.0, 6.0, 4.0, -1.0], [36.0, 36.0, 0.25, 0.25], [0.8, 0.0, 0.0])
    >>> np.allclose(sensor.clutter(x), 3.0 / (50.0 * 20.0 * 10.0 * 4.0))
    True
    >>> float(PositionVelocity(6.0, 0.5, 0.9, 2e-6).clutter(x))
    2e-06
    >>> sensor.invert(x[0]).mean.tolist(), np.diag(sensor.invert(x[0]).cov).tolist()
    ([40.0, 6.0, 4.0, -1.0], [36.0, 36.0, 0.25, 0.25])
    """

    kind: ClassVar[str] = "position_velocity"
    observes: ClassVar[Space] = _STATE

    sigma: float = fields.quantity("m", "standard deviation of the position per axis", above=0)
    sigma_speed: float = fields.quantity("m/s", "standard deviation of the velocity per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity(
        "s^2/m^4", "false returns per scan, area and area of velocities", default=0.0, at_least=0
    )

    def noise(self, x: Array) -> Array:
        return np.diag([self.sigma**2, self.sigma**2, self.sigma_speed**2, self.sigma_speed**2])
