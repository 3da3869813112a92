"""A sensor whose returns may lack components."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import evolve, frozen

from vedette import Array, Gaussian, Pose, Sensor, Space, fields


@final
@frozen
class Partial(Sensor):
    """A sensor of which some components may be missing in a return: `Detections.missing` says which.

    Such a return updates with, and is scored by, the components that it has. `optional` states over what length clutter
    spreads on each axis that may be missing, uniformly and whatever the others: the density over the rest is that much
    larger. Whether a component is missing says nothing about target or clutter. Only whole returns start tracks.
    Little, Rubin, Statistical Analysis with Missing Data, 2002 (what is missing at random leaves the rest its likelihood).
    """

    kind: ClassVar[str] = "partial"

    of: Sensor = fields.part("the sensor that reports all components")
    optional: dict[str, float] = fields.table("axis that may be missing to the length over which clutter spreads there")

    def __attrs_post_init__(self) -> None:
        known = self.of.measurement
        for name, length in self.optional.items():
            if name not in known:
                raise ValueError(f"optional.{name}: must be one of {', '.join(known.names)}")
            if length <= 0:
                raise ValueError(f"optional.{name}: must be > 0, got {length:g}")
        if len(self.optional) == len(known):
            raise ValueError(f"optional: must leave one of {', '.join(known.names)} that is always reported")

    @property
    def linear(self) -> bool:  # type: ignore[override]  # a class variable elsewhere: here it depends on the sensor
        """Whether the sensor is."""
        return self.of.linear

    @property
    def observes(self) -> Space:
        return self.of.observes

    @property
    def measurement(self) -> Space:
        return self.of.measurement

    def measure(self, x: Array) -> Array:
        """(*b, n) -> (*b, m)"""
        return self.of.measure(x)

    def jacobian(self, x: Array) -> Array:
        """(*b, n) -> (*b, m, n) or (m, n)"""
        return self.of.jacobian(x)

    def noise(self, x: Array) -> Array:
        """(*b, n) -> (*b, m, m) or (m, m)"""
        return self.of.noise(x)

    def detects(self, x: Array) -> Array:
        """(*b, n) -> (*b) or ()"""
        return self.of.detects(x)

    def clutter(self, z: Array) -> Array:
        """(*b, k, m) -> (*b, k) or (), of whole returns"""
        return self.of.clutter(z)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """(*b, m) -> (*b, n), (*b, n, n), of whole returns"""
        return self.of.invert(z, noise)

    def at(self, pose: Pose) -> Sensor:
        """The same of the sensor standing at `pose`."""
        return evolve(self, of=self.of.at(pose))
