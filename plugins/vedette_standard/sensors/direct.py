"""What the sensors share that report axes of the state as they are."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Pose, Sensor, Space


@frozen
class DirectSensor(Sensor):
    """z = the observed axes + v, in the tracker's own frame, with clutter of one density everywhere."""

    linear: ClassVar[bool] = True

    @property
    @abstractmethod
    def detection_probability(self) -> float:
        """Probability that a target in view gives a return; a parameter of the sensor."""

    @property
    @abstractmethod
    def clutter_density(self) -> float:
        """False returns per scan and unit of the measurement space; a parameter of the sensor."""

    @property
    def measurement(self) -> Space:
        return self.observes

    def measure(self, x: Array) -> Array:
        return x

    def jacobian(self, x: Array) -> Array:
        return np.eye(len(self.observes))

    def detects(self, x: Array) -> Array:
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        return np.asarray(self.clutter_density)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """(*b, n) -> (*b, n), (*b, n, n): the return, with its noise or the sensor's there."""
        cov = self.noise(z) if noise is None else noise
        return Gaussian(z, np.broadcast_to(cov, (*z.shape, z.shape[-1])))

    def at(self, pose: Pose) -> Sensor:
        """Return the same sensor: what it reports is absolute."""
        return self
