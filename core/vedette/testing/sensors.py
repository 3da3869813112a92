"""The kit's own sensors: a linear and a bent one over any axes of any state, and what another one is without something."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.roles import Sensor
from vedette.space import Array, Space
from vedette.wrapping import WrappedSensor

MEASURED = Space.of(z0="rad mod 2pi", z1="m", z2="m")


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


@final
@frozen(eq=False)
class Bent(Sensor):
    """z = (a bearing, two bent lengths) of u = (x - centre) / size, with noise and detection that depend on the state.

    z0 = turn + A0 u + B0 u^2 modulo 2 pi, z1 and z2 = A u + B u^2. R = C (1 + tanh(g u) / 2), P_D = .7 + .2 tanh(d u).
    """

    kind: ClassVar[str] = "kit_bent"
    measurement: ClassVar[Space] = MEASURED
    optional: ClassVar[Mapping[str, float]] = {"z1": 50.0, "z2": 50.0}

    observes: Space = fields.part("state axes")
    centre: Array = fields.array("1", "state around which it bends (n,)", ndim=1)
    size: Array = fields.array("1", "length of each axis over which it bends (n,)", ndim=1)
    A: Array = fields.array("1", "slopes (3, n)", ndim=2)
    B: Array = fields.array("1", "bends (3, n)", ndim=2)
    C: Array = fields.array("1", "noise (3, 3)", ndim=2)
    turn: float = fields.quantity("rad", "bearing at the centre")

    def _u(self, x: Array) -> Array:
        return self.observes.difference(x, self.centre) / self.size

    def measure(self, x: Array) -> Array:
        u = self._u(x)
        return MEASURED.canonical(u @ self.A.T + u**2 @ self.B.T + [self.turn, 0.0, 0.0])

    def jacobian(self, x: Array) -> Array:
        return (self.A + 2 * self.B * self._u(x)[..., None, :]) / self.size

    def noise(self, x: Array) -> Array:
        return self.C * (1.0 + 0.5 * np.tanh(self._u(x).sum(axis=-1)))[..., None, None]

    def detects(self, x: Array) -> Array:
        return 0.7 + 0.2 * np.tanh(2.0 * self._u(x)[..., 0])

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


@final
@frozen(eq=False)
class Tangent(WrappedSensor):
    """What another sensor comes to near one state: h(x0) + H (x - x0), and the detection of x0; its noise, or R."""

    kind: ClassVar[str] = "kit_tangent"

    of: Sensor = fields.part("the sensor")
    at_state: Array = fields.array("1", "x0 (n,)", ndim=1)
    R: Array | None = fields.array("1", "noise (m, m)", ndim=2, default=None)

    def measure(self, x: Array) -> Array:
        apart = self.observes.difference(x, self.at_state)
        return self.measurement.displace(self.of.measure(self.at_state), apart @ self.of.jacobian(self.at_state).T)

    def jacobian(self, x: Array) -> Array:
        return self.of.jacobian(self.at_state)

    def noise(self, x: Array) -> Array:
        return self.of.noise(self.at_state) if self.R is None else self.R

    def detects(self, x: Array) -> Array:
        return np.asarray(self.of.detects(self.at_state))

    def clutter(self, z: Array) -> Array:
        return np.zeros(())


@final
@frozen
class Altered(WrappedSensor):
    """A sensor with another detection probability and another density of false returns, the same everywhere."""

    kind: ClassVar[str] = "kit_altered"

    of: Sensor = fields.part("the sensor")
    detection: float = fields.probability("detection probability")
    density: float = fields.quantity("1", "false returns per unit of what is measured", at_least=0)

    def detects(self, x: Array) -> Array:
        """Return the detection probability."""
        return np.array(self.detection)

    def clutter(self, z: Array) -> Array:
        """Return the density."""
        return np.array(self.density)


@final
@frozen(eq=False)
class Untwinned(WrappedSensor):
    """Another sensor without its compiled twin."""

    kind: ClassVar[str] = "kit_untwinned"

    of: Sensor = fields.part("the sensor")
