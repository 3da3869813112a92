"""The sensor that stands for a radar picture: a camera whose pictures only a detector reads."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Frame, ImagingSensor, Pose, Sensor, Space, fields

POSITION = Space.of(x="m", y="m")
"""East and north in the local frame."""


@final
@frozen
class RadarScreen(ImagingSensor):
    """A radar's screen, or the polar sweeps behind it, as named in a detector's `sensors`.

    By itself it carries no information on a target: J = 0, llr = 0. The detector turns its pictures into positions.

    >>> screen, x = RadarScreen(resolution=12.0), np.array([[300.0, -40.0]])
    >>> screen.measure(x).tolist(), screen.noise(x).tolist(), screen.jacobian(x).tolist(), float(screen.detects(x))
    ([[300.0, -40.0]], [[144.0, 0.0], [0.0, 144.0]], [[1.0, 0.0], [0.0, 1.0]], 1.0)
    >>> [part.tolist() for part in screen.information(x, Frame(np.ones((9, 9))), x)]
    [[[[0.0, 0.0], [0.0, 0.0]]], [[0.0, 0.0]], [0.0]]
    """

    kind: ClassVar[str] = "radar_screen"
    linear: ClassVar[bool] = True
    observes: ClassVar[Space] = POSITION
    measurement: ClassVar[Space] = POSITION

    resolution: float = fields.quantity("m", "standard deviation of a position read off it, per axis", default=10.0, above=0)

    def measure(self, x: Array) -> Array:
        """Return the position itself: (*b, 2) -> (*b, 2)."""
        return x

    def jacobian(self, x: Array) -> Array:
        """Return the identity (2, 2)."""
        return np.eye(2)

    def noise(self, x: Array) -> Array:
        """Return the covariance (2, 2)."""
        return self.resolution**2 * np.eye(2)

    def detects(self, x: Array) -> Array:
        """Return 1: ()."""
        return np.ones(())

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Return no information: (*b, t, 2, 2), (*b, t, 2), (*b, t)."""
        none = np.zeros((*at.shape[:-1], 2))
        return np.zeros((*none.shape, 2)), none, np.zeros(none.shape[:-1])

    def at(self, pose: Pose) -> Sensor:
        """Return the sensor itself: positions are absolute."""
        return self
