"""The bases of motion models, sensors and estimators that change something about another one, and forward the rest."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, Generic

from attrs import evolve, frozen

from vedette.roles import B, Estimator, MotionModel, Sensor
from vedette.space import Array, Mask, Space
from vedette.types import Gaussian, Pose


@frozen
class WrappedMotion(MotionModel):
    """A motion model that is another one, `of`, but for what a subclass defines."""

    @property
    @abstractmethod
    def of(self) -> MotionModel:
        """The motion model; a parameter."""

    @property
    def linear(self) -> bool:
        """Whether the model is."""
        return self.of.linear

    @property
    def divisible(self) -> bool:
        """Whether the model is."""
        return self.of.divisible

    @property
    def reframes(self) -> bool:
        """Whether the model does."""
        return self.of.reframes

    @property
    def state(self) -> Space:
        return self.of.state

    @property
    def zero_variance(self) -> Space:
        return self.of.zero_variance

    def move(self, x: Array, dt: float) -> Array:
        return self.of.move(x, dt)

    def jacobian(self, x: Array, dt: float) -> Array:
        return self.of.jacobian(x, dt)

    def noise(self, x: Array, dt: float) -> Array:
        return self.of.noise(x, dt)

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        """Return the mean of the model's noise, or of the subclass's own at the mean: (*b, n), (*b, n, n) -> (*b, n, n)."""
        overridden = type(self).noise is not WrappedMotion.noise
        return self.noise(x, dt) if overridden else self.of.mean_noise(x, cov, dt)

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        """Return the belief in the frame that the model chooses."""
        return self.of.reframe(own, combined)


@frozen
class WrappedSensor(Sensor):
    """A sensor that passes everything on to another one, `of`, except for what a subclass defines.

    `at` places `of` alone: a subclass whose own methods ask where the target is defines it too, or refuses.
    """

    @property
    @abstractmethod
    def of(self) -> Sensor:
        """The sensor that is wrapped: a parameter of the subclass."""

    @property
    def linear(self) -> bool:
        """Whether `of` is linear."""
        return self.of.linear

    @property
    def claims(self) -> bool:
        """Whether the returns of `of` are claims."""
        return self.of.claims

    @property
    def observes(self) -> Space:
        return self.of.observes

    @property
    def measurement(self) -> Space:
        return self.of.measurement

    @property
    def optional(self) -> Mapping[str, float]:
        return self.of.optional

    def measure(self, x: Array) -> Array:
        return self.of.measure(x)

    def jacobian(self, x: Array) -> Array:
        return self.of.jacobian(x)

    def noise(self, x: Array) -> Array:
        return self.of.noise(x)

    def mean_noise(self, x: Array, cov: Array) -> Array:
        """Return the mean of the sensor's noise, or of the subclass's own at the mean: (*b, n), (*b, n, n) -> (*b, m, m)."""
        overridden = type(self).noise is not WrappedSensor.noise or type(self).measure is not WrappedSensor.measure
        return self.noise(x) if overridden else self.of.mean_noise(x, cov)

    def detects(self, x: Array) -> Array:
        return self.of.detects(x)

    def clutter(self, z: Array) -> Array:
        return self.of.clutter(z)

    def covers(self, z: Array) -> Mask:
        return self.of.covers(z)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """(*b, m) -> (*b, n), (*b, n, n)"""
        return self.of.invert(z, noise)

    def unresolved(self, x: Array) -> Array | None:
        """(*b, n) -> (*b, m, m) or None"""
        return self.of.unresolved(x)

    def at(self, pose: Pose) -> Sensor:
        """Return the same around the sensor standing at `pose`."""
        return evolve(self, of=self.of.at(pose))  # type: ignore[call-arg]  # `of` is a parameter of every subclass


@frozen
class WrappedEstimator(Estimator[B], Generic[B]):
    """An estimator over the axes of another one, `of`, for the sensors that this takes; its belief is its own."""

    @property
    @abstractmethod
    def of(self) -> Estimator[Any]:
        """The estimator that is wrapped: a parameter of the subclass."""

    @property
    def state(self) -> Space:
        return self.of.state

    @property
    def zero_variance(self) -> Space:
        return self.of.zero_variance

    def refuses(self, sensor: Sensor) -> str | None:
        """Return why `of` refuses a sensor, or None."""
        return self.of.refuses(sensor)
