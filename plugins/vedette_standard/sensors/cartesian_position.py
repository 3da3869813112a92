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
    """z = position + v, v ~ N(0, sigma^2 I): a position in the tracker's own frame, whatever platform it comes from.

    >>> from vedette_standard import Detection
    >>> from vedette_standard.sensors.view import Sector
    >>> view = {"heading": 0.5, "max_range": 50.0, "clutter_per_scan": 3.0, "sectors": (Sector(-1.0, 0.5),)}
    >>> sensor = CartesianPosition(6.0, 0.8, x=10.0, y=20.0, **view)
    >>> x = 10.0 * np.array([[1.0, 2.0]]) + 40.0 * np.array([[np.cos(a), np.sin(a)] for a in (-0.4, 0.9, 1.1)])
    >>> sensor.measure(x[0]).tolist() == x[0].tolist(), sensor.noise(x).tolist(), sensor.detects(x).tolist()
    (True, [[36.0, 0.0], [0.0, 36.0]], [0.8, 0.8, 0.0])
    >>> np.allclose(sensor.clutter(x), 3.0 / (0.5 * 1.5 * 50.0**2)), float(CartesianPosition(6.0, 0.8, 2e-6).clutter(x))
    (True, 2e-06)
    >>> table = Detection([[1.0, 0.5], [0.25, 0.0]], ranges=[0.0, 30.0], bearings=[0.0, 1.0])  # rows are ranges
    >>> seen = CartesianPosition(6.0, 0.8, detection=table)
    >>> seen.detects(np.array([[20.0, 1.0], [0.0, 20.0], [40.0, 1.0], [0.0, 40.0]])).tolist()
    [0.8, 0.4, 0.2, 0.0]
    >>> found = sensor.invert(x[:1], np.array([[[4.0, 1.0], [1.0, 9.0]]]))
    >>> found.mean.tolist() == x[:1].tolist(), found.cov.tolist()
    (True, [[[4.0, 1.0], [1.0, 9.0]]])
    """

    kind: ClassVar[str] = "cartesian_position"
    abbreviations: ClassVar[tuple[str, ...]] = ("position",)
    observes: ClassVar[Space] = POSITION

    sigma: float = fields.quantity("m", "standard deviation per axis", above=0)
    detection_probability: float = fields.probability("probability that a target in view gives a return", default=1.0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)

    def noise(self, x: Array) -> Array:
        return self.sigma**2 * np.eye(2)
