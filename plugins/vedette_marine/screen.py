"""What a radar picture is to the tracker's source: a camera whose pictures only a detector reads."""

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
    """A radar's screen, or the polar sweeps behind it; stands in a detector's `sensors`.

    By itself it tells a tracker nothing of a target: J = 0, llr = 0. The detector makes positions of its pictures.
    """

    kind: ClassVar[str] = "radar_screen"
    linear: ClassVar[bool] = True

    resolution: float = fields.quantity("m", "standard deviation of a position read off it, per axis", default=10.0, above=0)

    @property
    def observes(self) -> Space:
        return POSITION

    @property
    def measurement(self) -> Space:
        return POSITION

    def measure(self, x: Array) -> Array:
        """(*b, 2) -> (*b, 2)"""
        return x

    def jacobian(self, x: Array) -> Array:
        """(2, 2)"""
        return np.eye(2)

    def noise(self, x: Array) -> Array:
        """(2, 2)"""
        return self.resolution**2 * np.eye(2)

    def detects(self, x: Array) -> Array:
        """()"""
        return np.ones(())

    def information(self, x: Array, frame: Frame, at: Array) -> tuple[Array, Array, Array]:
        """Nothing: (*b, t, 2, 2), (*b, t, 2), (*b, t)"""
        none = np.zeros((*at.shape[:-1], 2))
        return np.zeros((*none.shape, 2)), none, np.zeros(none.shape[:-1])

    def at(self, pose: Pose) -> Sensor:
        """The same: positions are absolute."""
        return self
