"""A sensor whose registration errors are known numbers."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import Factory, evolve, field, frozen

from vedette import Array, Gaussian, Pose, Sensor, Space, WrappedSensor, fields
from vedette_standard.sensors.biased import Biased

_MARK = "offset of "


def _biased(self: Displaced) -> Biased:
    """Return the sensor with its errors as axes that no state has, each called by what it displaces."""
    add, offset = ({axis: f"{_MARK}{axis}" for axis in table} for table in (self.add, self.offset))
    if both := sorted(set(add) & set(offset)):
        raise ValueError(f"offset.{both[0]}: is in add, too")
    return Biased(self.of, add, offset, f"{_MARK}time" if self.lag else "")


def _observed(self: Displaced) -> Space:
    return Space(tuple(axis for axis in self.biased.observes.axes if not axis.name.startswith(_MARK)))


@final
@frozen
class Displaced(WrappedSensor):
    """z = h(x + o - l v) + a + noise, with numbers a on the measurement, o on the position and a lag l.

    It is 'biased' with errors that are known: a sensor that was registered, or one that a scene draws wrongly.
    Bar-Shalom, Willett, Tian, Tracking and Data Fusion, 2011, section 9.4 (what an error of registration is).

    >>> import numpy as np
    >>> from vedette_standard import CartesianPosition, RangeBearing
    >>> sensor = Displaced(RangeBearing(6.0, 0.02), add={"range": 4.0, "bearing": -0.1}, offset={"x": 10.0}, lag=2.0)
    >>> x = np.array([26.0, 48.0, 3.0, 4.0])  # seen where it was 2 s ago, 10 m to the east: at 30 and 40 m
    >>> np.allclose(sensor.measure(x), [50.0 + 4.0, np.arctan2(40.0, 30.0) - 0.1])
    True
    >>> by_differences = [(sensor.measure(x + d) - sensor.measure(x - d)) / 2e-4 for d in 1e-4 * np.eye(4)]
    >>> np.allclose(sensor.jacobian(x), np.transpose(by_differences)), np.allclose(sensor.noise(x), np.diag([36.0, 0.0004]))
    (True, True)
    >>> plain = Displaced(CartesianPosition(6.0, 0.8), add={"y": 7.0}, offset={"x": 10.0})
    >>> plain.measure(np.array([1.0, 2.0])).tolist(), plain.invert(np.array([11.0, 9.0])).mean.tolist()
    ([11.0, 9.0], [1.0, 2.0])
    """

    kind: ClassVar[str] = "displaced"

    of: Sensor = fields.part("the sensor as it would be with perfect registration")
    add: dict[str, float] = fields.table("measured axis to what is added to it, in its unit")
    offset: dict[str, float] = fields.table("state axis that is seen, such as x, to that by which it is displaced")
    lag: float = fields.quantity("s", "time by which the returns are late", default=0.0)
    biased: Biased = field(init=False, repr=False, eq=False, default=Factory(_biased, takes_self=True))
    observes: Space = field(init=False, repr=False, eq=False, default=Factory(_observed, takes_self=True))

    @property
    def linear(self) -> bool:
        return self.of.linear

    def _with_errors(self, x: Array) -> Array:
        """Return states with the errors as axes: (*b, n) -> (*b, n + q)."""
        errors = [*self.add.values(), *self.offset.values(), *([self.lag] if self.lag else [])]
        return np.concatenate([x, np.broadcast_to(errors, (*x.shape[:-1], len(errors)))], axis=-1)

    def measure(self, x: Array) -> Array:
        """Return the expected measurement: (*b, n) -> (*b, m)."""
        return self.biased.measure(self._with_errors(x))

    def jacobian(self, x: Array) -> Array:
        """Return H: (*b, n) -> (*b, m, n)."""
        return self.biased.jacobian(self._with_errors(x))[..., : len(self.observes)]

    def noise(self, x: Array) -> Array:
        """Return R: (*b, n) -> (*b, m, m) or (m, m)."""
        return self.biased.noise(self._with_errors(x))

    def unresolved(self, x: Array) -> Array | None:
        """Return C: (*b, n) -> (*b, m, m), or None."""
        return self.biased.unresolved(self._with_errors(x))

    def detects(self, x: Array) -> Array:
        """Return the detection probability: (*b, n) -> (*b) or ()."""
        return self.biased.detects(self._with_errors(x))

    def at(self, pose: Pose) -> Sensor:
        """Return the same on a platform at `pose`; where returns are late, it was elsewhere then, too."""
        if self.offset:
            raise NotImplementedError("an offset along x and y would turn with its platform: state it in the poses")
        if self.lag and pose.velocity is not None and not self.biased.relative:  # else 'biased' sees to it
            pose = evolve(pose, position=pose.position - self.lag * pose.velocity)
        return evolve(self, of=self.of.at(pose))

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Invert the return without its errors: (*b, m) -> (*b, n), (*b, n, n); a lag would need the velocity."""
        if self.lag:
            raise NotImplementedError("a return that is late gives no position without a velocity")
        step = np.array([self.add.get(name, 0.0) for name in self.measurement.names])
        spot = self.of.invert(self.measurement.displace(z, -step), noise)
        back = np.array([self.offset.get(name, 0.0) for name in self.of.observes.names])
        return Gaussian(self.of.observes.displace(spot.mean, -back), spot.cov)
