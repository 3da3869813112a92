"""A sensor as a third party would write it: plain numpy, not tuned."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from benchmarks.problems import POLAR
from vedette import Array, Sensor, Space


@final
@frozen
class ForeignRadar(Sensor):
    """Range and bearing from the origin."""

    kind: ClassVar[str] = "foreign_radar"
    observes: ClassVar[Space] = Space.of(x="m", y="m")
    measurement: ClassVar[Space] = Space.of(range="m", bearing="rad mod 2pi")

    def measure(self, x: Array) -> Array:
        return np.stack([np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])], axis=-1)

    def jacobian(self, x: Array) -> Array:
        r2 = x[..., 0] ** 2 + x[..., 1] ** 2
        r = np.sqrt(r2)
        along = np.stack([x[..., 0] / r, x[..., 1] / r], axis=-1)
        across = np.stack([-x[..., 1] / r2, x[..., 0] / r2], axis=-1)
        return np.stack([along, across], axis=-2)

    def noise(self, x: Array) -> Array:
        return np.diag(np.square(POLAR))

    def detects(self, x: Array) -> Array:
        return np.ones(())

    def clutter(self, z: Array) -> Array:
        return np.zeros(())
