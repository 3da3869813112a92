"""Boxes that a detector found in a camera's frames."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Sensor, Space, fields
from vedette_flir.sources.boxes import BOX


@final
@frozen
class DetectedBox(Sensor):
    """Places and sizes of targets, detected in frames that the tracker also gets as they are: z = (x, y, width, height).

    R = diag(sigma^2, sigma^2, sigma_size^2, sigma_size^2); false detections are uniform over `volume`, `false_alarms` a
    frame. An estimator that measures in the frames themselves takes these as claims only: what starts tracks.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 5.2.

    >>> found = DetectedBox(sigma=4.0, sigma_size=9.0, detection_probability=0.7, false_alarms=0.3, volume=6e8)
    >>> box = np.array([30.0, 40.0, 12.0, 8.0])
    >>> found.measure(box).tolist(), np.diag(found.noise(box)).tolist(), float(found.detects(box)), float(found.clutter(box))
    ([30.0, 40.0, 12.0, 8.0], [16.0, 16.0, 81.0, 81.0], 0.7, 5e-10)
    >>> found.invert(box).mean.tolist(), np.diag(found.invert(box, np.diag([1.0, 2.0, 3.0, 4.0])).cov).tolist()
    ([30.0, 40.0, 12.0, 8.0], [1.0, 2.0, 3.0, 4.0])
    """

    kind: ClassVar[str] = "detected_box"
    linear: ClassVar[bool] = True
    claims: ClassVar[bool] = True

    sigma: float = fields.quantity("px", "standard deviation of a place, per axis", default=3.0, above=0)
    sigma_size: float = fields.quantity("px", "standard deviation of width and height", default=20.0, above=0)
    detection_probability: float = fields.probability("probability that a target is detected in a frame", default=0.5)
    false_alarms: float = fields.quantity("1", "mean number of false detections in a frame", default=0.5, above=0)
    volume: float = fields.quantity(
        "1", "places in px^2 times sizes in px^2 over which they are spread", default=2e8, above=0
    )

    @property
    def observes(self) -> Space:
        return BOX

    @property
    def measurement(self) -> Space:
        return BOX

    def measure(self, x: Array) -> Array:
        """Return the box itself: (*b, 4) -> (*b, 4)."""
        return x

    def jacobian(self, x: Array) -> Array:
        """Return I (4, 4)."""
        return np.eye(4)

    def noise(self, x: Array) -> Array:
        """Return R (4, 4)."""
        return np.diag([self.sigma**2, self.sigma**2, self.sigma_size**2, self.sigma_size**2])

    def detects(self, x: Array) -> Array:
        """Return the detection probability: ()."""
        return np.asarray(self.detection_probability)

    def clutter(self, z: Array) -> Array:
        """Return the density of false detections, in 1/px^4: ()."""
        return np.asarray(self.false_alarms / self.volume)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return the box as it was found: (*b, 4) -> mean (*b, 4), cov (*b, 4, 4)."""
        R = self.noise(z) if noise is None else noise
        return Gaussian(z, np.broadcast_to(R, (*z.shape, 4)))
