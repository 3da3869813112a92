"""Boxes that a detector draws around objects in a camera's image."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Gaussian, Mask, Sensor, Space, fields

BOX = Space.of(x="px", y="px", width="px", height="px")
LEAST = 1.0
"""Sides in px below which noise falls no further."""


def _pair(numbers: Array) -> str | None:
    return None if len(numbers) == 2 and np.all(numbers > 0) else f"must be two numbers > 0, got {numbers.tolist()}"


def _range(numbers: Array) -> str | None:
    wrong = _pair(numbers)
    return wrong if wrong or numbers[0] < numbers[1] else f"must ascend, got {numbers.tolist()}"


@final
@frozen
class Box(Sensor):
    """z = (x, y, width, height) + v, the middle and the sides of a box, with errors that are parts of its sides.

    v ~ N(0, diag(s^2 + (p w)^2, s^2 + (p h)^2, s^2 + (q w)^2, s^2 + (q h)^2)), p = `sigma_place`, q = `sigma_size`,
    s = `sigma`. A target is detected while its middle lies in the image and its sides between `sizes` a, b. False boxes lie
    anywhere there, the logarithms of their sides uniform: of n = `clutter_per_scan` the density is n / (W H w h log(b/a)^2).
    Wojke, Bewley, Paulus, Simple Online and Realtime Tracking with a Deep Association Metric, ICIP 2017 (errors as parts).

    >>> box = Box(sigma_place=0.1, sigma_size=0.2, sigma=3.0, detection_probability=0.7, clutter_per_scan=5.0,
    ...           image=np.array([640.0, 480.0]), sizes=np.array([10.0, 200.0]))
    >>> z = np.array([[300.0, 200.0, 40.0, 100.0], [300.0, 200.0, 40.0, 210.0], [-1.0, 200.0, 40.0, 100.0]])
    >>> np.diag(box.noise(z)[0]).round(9).tolist(), box.detects(z).tolist()  # 9 + 4^2 ..; too high; outside
    ([25.0, 109.0, 73.0, 409.0], [0.7, 0.0, 0.0])
    >>> np.diag(box.mean_noise(z[0], np.diag([1.0, 2.0, 100.0, 400.0]))).round(9).tolist()  # of mean squares 1700, 10400
    [26.0, 113.0, 77.0, 425.0]
    >>> np.allclose(box.clutter(z[0]), 5 / (640 * 480 * 40 * 100 * np.log(20) ** 2))
    True
    >>> found = box.invert(z[0])
    >>> found.mean.tolist(), np.diag(found.cov).round(9).tolist()
    ([300.0, 200.0, 40.0, 100.0], [25.0, 109.0, 73.0, 409.0])
    """

    kind: ClassVar[str] = "box"
    observes: ClassVar[Space] = BOX
    measurement: ClassVar[Space] = BOX

    sigma_place: float = fields.quantity(
        "1", "standard deviation of the middle, as a part of the side along it", default=0.05, above=0, at_most=1
    )
    sigma_size: float = fields.quantity(
        "1", "standard deviation of a side, as a part of it", default=0.1, above=0, at_most=1
    )
    sigma: float = fields.quantity("px", "standard deviation of all of them besides", default=0.5, above=0)
    detection_probability: float = fields.probability("probability that a target in the image is detected", default=0.9)
    clutter_per_scan: float = fields.quantity("1", "expected number of false boxes in a frame", default=1.0, at_least=0)
    image: Array = fields.array("px", "width and height of the image", ndim=1, default=(1920.0, 1080.0), check=_pair)
    sizes: Array = fields.array(
        "px", "least and greatest side of a box that the detector gives", ndim=1, default=(10.0, 1000.0), check=_range
    )

    def measure(self, x: Array) -> Array:
        """Return the box itself: (*b, 4) -> (*b, 4)."""
        return x

    def jacobian(self, x: Array) -> Array:
        """Return I (4, 4)."""
        return np.eye(4)

    def noise(self, x: Array) -> Array:
        return self._of_squares(np.maximum(x[..., 2:], LEAST) ** 2)

    def mean_noise(self, x: Array, cov: Array) -> Array:
        """Return the mean of R over a belief, by the mean squares of the sides: (*b, 4), (*b, 4, 4) -> (*b, 4, 4)."""
        return self._of_squares(np.maximum(x[..., 2:], LEAST) ** 2 + np.diagonal(cov, axis1=-2, axis2=-1)[..., 2:])

    def _of_squares(self, squares: Array) -> Array:
        """Return R for the squares of the sides: (*b, 2) -> (*b, 4, 4)."""
        R = np.zeros((*squares.shape[:-1], 4, 4))
        for i, part in enumerate((self.sigma_place, self.sigma_place, self.sigma_size, self.sigma_size)):
            R[..., i, i] = self.sigma**2 + part**2 * squares[..., i % 2]
        return R

    def detects(self, x: Array) -> Array:
        return np.where(self.covers(x), self.detection_probability, 0.0)

    def covers(self, z: Array) -> Mask:
        """Return whether a box lies in the image and has a size that the detector gives: (*b, 4) -> (*b)."""
        low, high = np.array([[0.0, self.image[0]], [0.0, self.image[1]], self.sizes, self.sizes]).T
        return np.all((z >= low) & (z <= high), axis=-1)

    def clutter(self, z: Array) -> Array:
        """Return the density of false boxes, beyond the limits as at them: (*b, 4) -> (*b) in 1/px^4."""
        low, high = self.sizes
        sides = np.prod(np.clip(z[..., 2:], low, high), axis=-1)
        return self.clutter_per_scan / (np.prod(self.image) * sides * math.log(high / low) ** 2)

    def invert(self, z: Array, noise: Array | None = None) -> Gaussian:
        """Return the box as it was found: (*b, 4) -> (*b, 4), (*b, 4, 4)."""
        return Gaussian(z, self.noise(z) if noise is None else np.broadcast_to(noise, (*z.shape, 4)))
