"""The kit's own linear sensor, over any axes of any state."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.roles import Sensor
from vedette.space import Array, Space


@final
@frozen(eq=False)
class Watch(Sensor):
    """z = H x + v over the axes `observes`; v ~ N(0, R) with constant R, P_D and clutter density.

    H is the identity unless `mix` says otherwise; then what is measured has axes z0, z1 ... without a period.
    """

    kind: ClassVar[str] = "kit_watch"
    linear: ClassVar[bool] = True

    observes: Space = fields.part("state axes")
    R: Array = fields.array("1", "measurement noise", ndim=2)
    probability: float = fields.probability("of detection", default=1.0)
    density: float = fields.quantity("1", "clutter density", default=0.0, at_least=0)
    mix: Array | None = fields.array("1", "H", ndim=2, default=None)

    @property
    def measurement(self) -> Space:
        return self.observes if self.mix is None else Space.of(**{f"z{i}": "1" for i in range(len(self.mix))})

    @property
    def optional(self) -> Mapping[str, float]:
        return {} if self.mix is None else dict.fromkeys(self.measurement.names, 50.0)

    @property
    def H(self) -> Array:
        """The matrix (m, n)."""
        return np.eye(len(self.observes)) if self.mix is None else self.mix

    def measure(self, x: Array) -> Array:
        return x if self.mix is None else x @ self.mix.T

    def jacobian(self, x: Array) -> Array:
        return self.H

    def noise(self, x: Array) -> Array:
        return self.R

    def detects(self, x: Array) -> Array:
        return np.asarray(self.probability)

    def clutter(self, z: Array) -> Array:
        return np.asarray(self.density)
