"""A radar whose unbiased positions have a noise that does not depend on them, but on where the target is believed to be."""

from __future__ import annotations

from copy import copy
from typing import ClassVar, final

import numpy as np
from attrs import field, frozen

from vedette import Array, Pose, Sensor, Space, fields
from vedette_standard import DirectSensor

_NEAR = 1e-6
"""In m^2; within its root there is no direction from the radar, and the noise is the mean over all."""


@final
@frozen
class DecorrelatedPosition(DirectSensor):
    """z = exp(s/2) r (cos b, sin b) + the radar's position, unbiased given the target; s = sigma_bearing^2.

    Given the target at d from the radar, with q = sigma_range^2, a = exp(s)(1 + exp(-2s))/2, c = exp(s)(1 - exp(-2s))/2:
    R = (a - 1 - c) d d' + c (|d|^2 + q) I + q exp(-s) d d'/|d|^2. Its mean over the belief takes M = d d' + P for d d'.
    A covariance from the return itself is small where the return errs towards the radar: gain and error are then correlated,
    and the filter is biased and too sure. Goes with the preprocessor `decorrelated_conversion`.
    Bordonaro, Willett, Bar-Shalom, Decorrelated Unbiased Converted Measurement Kalman Filter, IEEE T-AES 50, 2014.

    >>> sensor, s, q = DecorrelatedPosition(6.0, 0.2, x=10.0, y=20.0), 0.04, 36.0
    >>> x, d = np.array([40.0, 60.0]), np.array([30.0, 40.0])
    >>> a, c = np.exp(s) * (1.0 + np.exp(-2.0 * s)) / 2.0, np.exp(s) * (1.0 - np.exp(-2.0 * s)) / 2.0
    >>> def noise(M):
    ...     return (a - 1.0 - c) * M + c * (np.trace(M) + q) * np.eye(2) + q * np.exp(-s) * M / np.trace(M)
    >>> np.allclose(sensor.noise(x), noise(np.outer(d, d)))
    True
    >>> P = np.array([[400.0, 30.0], [30.0, 100.0]])
    >>> np.allclose(sensor.mean_noise(x, P), noise(np.outer(d, d) + P)), sensor.measure(x).tolist()
    (True, [40.0, 60.0])
    """

    kind: ClassVar[str] = "decorrelated_position"
    observes: ClassVar[Space] = Space.of(x="m", y="m")

    sigma_range: float = fields.quantity("m", "standard deviation along the line of sight", above=0)
    sigma_bearing: float = fields.quantity("rad", "standard deviation of the bearing", above=0, at_most=1)
    detection_probability: float = fields.probability("probability that a target gives a return", default=1.0)
    clutter_density: float = fields.quantity("1/m^2", "false returns per scan and area", default=0.0, at_least=0)
    x: float = fields.quantity("m", "where the radar stands; a scan's own pose replaces it", default=0.0)
    y: float = fields.quantity("m", "where the radar stands; a scan's own pose replaces it", default=0.0)
    _pose: Pose = field(init=False, repr=False, eq=False)

    @_pose.default
    def _fixed(self) -> Pose:
        return Pose(np.array([self.x, self.y]))

    @property
    def pose(self) -> Pose:
        """Where it stands."""
        return self._pose

    def noise(self, x: Array) -> Array:
        return self.mean_noise(x, np.zeros((2, 2)))

    def mean_noise(self, x: Array, cov: Array) -> Array:
        place = self._pose.position
        d = x - place.reshape(*place.shape[:-1], *(1,) * (x.ndim - place.ndim), 2)
        M = d[..., :, None] * d[..., None, :] + cov + 0.5 * _NEAR * np.eye(2)
        square = np.trace(M, axis1=-2, axis2=-1)[..., None, None]
        s, q = self.sigma_bearing**2, self.sigma_range**2
        along, across = np.exp(s) * (1.0 + 0.5 * np.expm1(-2 * s)), -0.5 * np.exp(s) * np.expm1(-2 * s)
        whole = (along - 1.0 - across + q * np.exp(-s) / square) * M
        return whole + across * (square + q) * np.eye(2)

    def at(self, pose: Pose) -> Sensor:
        """Return the same radar on a platform at `pose`."""
        moved = copy(self)
        object.__setattr__(moved, "_pose", pose)  # no parameter changes, so none is checked again
        return moved
