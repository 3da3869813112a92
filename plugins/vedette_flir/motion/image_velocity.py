"""A target at constant velocity in the image of a camera that may jerk."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_flir.motion.processes import ImagePlane


@final
@frozen
class ImageVelocity(ImagePlane):
    """Constant velocity in pixels with white acceleration, and white velocity for the jerks of a camera, per axis.

    F = [1 T; 0 1], Q = q [T^3/3 T^2/2; T^2/2 T] + s [T 0; 0 0], q = sigma_accel^2, s = shake^2:
    the spectral densities of acceleration and velocity. What white noise gains in T s grows with the square root of T.
    Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.2.

    >>> model, T = ImageVelocity(sigma_accel=30.0, shake=4.0), 0.5
    >>> model.move(np.array([100.0, 50.0, 6.0, -4.0]), T).tolist()
    [103.0, 48.0, 6.0, -4.0]
    >>> Q = 900.0 * np.array([[T**3 / 3.0, T**2 / 2.0], [T**2 / 2.0, T]]) + np.diag([16.0 * T, 0.0])
    >>> np.allclose(model.noise(np.zeros(4), T), np.kron(Q, np.eye(2)))
    True
    """

    kind: ClassVar[str] = "image_velocity"
    space: ClassVar[Space] = Space.of(x="px", y="px", vx="px/s", vy="px/s")

    sigma_accel: float = fields.quantity(
        "px/s^1.5", "standard deviation of the velocity gained in 1 s", default=400.0, above=0
    )
    shake: float = fields.quantity("px/s^0.5", "standard deviation of the camera's wander in 1 s", default=20.0, at_least=0)

    def one_axis(self, dt: float) -> tuple[Array, Array]:
        """Return F and Q (2, 2)."""
        q = self.sigma_accel**2
        noise = np.array([[q * dt**3 / 3 + self.shake**2 * dt, q * dt**2 / 2], [q * dt**2 / 2, q * dt]])
        return np.array([[1.0, dt], [0.0, 1.0]]), noise
