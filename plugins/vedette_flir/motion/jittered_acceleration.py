"""A manoeuvring target seen through a turbulent atmosphere."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_flir.motion.processes import ImagePlane, apart, fading


@final
@frozen
class JitteredAcceleration(ImagePlane):
    """The filter of the paper: position, velocity and acceleration with white jerk, and first-order jitter, per axis.

    x' = v, v' = a, a' = w, E[w w] = jerk_density delta; j' = -j/tau + w_j. Where the target appears is x + j. Discretised
    exactly: F = [1 T T^2/2; 0 1 T; 0 0 1], Q = q [T^5/20 T^4/8 T^3/6; T^4/8 T^3/3 T^2/2; T^3/6 T^2/2 T]; e^(-T/tau).
    Maybeck, Mercier, A Target Tracker Using Spatially Distributed Infrared Measurements, IEEE T-AC 25, 1980.

    >>> model, T = JitteredAcceleration(jerk_density=200.0, sigma_jitter=0.4, tau_jitter=0.25), 0.5
    >>> x, e = np.array([100.0, 50.0, 6.0, -4.0, 8.0, 16.0, 0.3, -0.2]), np.exp(-2.0)
    >>> np.allclose(model.move(x, T), [104.0, 50.0, 10.0, 4.0, 8.0, 16.0, 0.3 * e, -0.2 * e])
    True
    >>> Q = [[T**5 / 20.0, T**4 / 8.0, T**3 / 6.0], [T**4 / 8.0, T**3 / 3.0, T**2 / 2.0], [T**3 / 6.0, T**2 / 2.0, T]]
    >>> np.allclose(model.noise(x, T)[:6, :6], np.kron(200.0 * np.array(Q), np.eye(2)))
    True
    >>> np.allclose(model.noise(x, T)[6:, 6:], 0.16 * (1.0 - e * e) * np.eye(2)), float(np.sum(model.noise(x, T)[:6, 6:]))
    (True, 0.0)
    """

    kind: ClassVar[str] = "jittered_acceleration"
    space: ClassVar[Space] = Space.of(
        x="px", y="px", vx="px/s", vy="px/s", ax="px/s^2", ay="px/s^2", jx="px", jy="px"
    )  # fmt: skip

    jerk_density: float = fields.quantity("px^2/s^5", "spectral density of the jerk", default=1e5, above=0)
    sigma_jitter: float = fields.quantity("px", "standard deviation of the jitter", default=0.2, above=0)
    tau_jitter: float = fields.quantity("s", "correlation time of the jitter", default=0.076, above=0)

    def one_axis(self, dt: float) -> tuple[Array, Array]:
        """Return F and Q (4, 4)."""
        q, F, Q = self.jerk_density, *fading(self.tau_jitter, self.sigma_jitter, dt)
        flight = np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])
        noise = np.array(
            [
                [q * dt**5 / 20, q * dt**4 / 8, q * dt**3 / 6],
                [q * dt**4 / 8, q * dt**3 / 3, q * dt**2 / 2],
                [q * dt**3 / 6, q * dt**2 / 2, q * dt],
            ]
        )
        return apart(flight, F), apart(noise, Q)
