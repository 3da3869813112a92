"""A target that wanders about a point, seen through a turbulent atmosphere."""

from __future__ import annotations

from typing import ClassVar, final

from attrs import frozen

from vedette import Array, Space, fields
from vedette_flir.motion.processes import ImagePlane, apart, fading


@final
@frozen
class JitteredWander(ImagePlane):
    """Position and jitter, each a first-order Gauss-Markov process: x' = -x/tau + w, j' = -j/tau_j + w_j. x + j is observed.

    The filter model for `atmospheric_wander`: its third-order jitter is replaced by one of first order with the
    same correlation from frame to frame: tau_j = .076 s at 30 frames/s.
    Maybeck, Mercier, A Target Tracker Using Spatially Distributed Infrared Measurements, IEEE T-AC 25, 1980.

    >>> import numpy as np
    >>> model, e, f = JitteredWander(sigma=3.0, tau=2.0, sigma_jitter=0.4, tau_jitter=0.25), np.exp(-0.25), np.exp(-2.0)
    >>> np.allclose(model.move(np.array([10.0, -5.0, 0.3, -0.2]), 0.5), [10.0 * e, -5.0 * e, 0.3 * f, -0.2 * f])
    True
    >>> wander, jitter = 9.0 * (1.0 - e * e), 0.16 * (1.0 - f * f)
    >>> np.allclose(model.noise(np.zeros(4), 0.5), np.diag([wander, wander, jitter, jitter]))
    True
    """

    kind: ClassVar[str] = "jittered_wander"
    space: ClassVar[Space] = Space.of(x="px", y="px", jx="px", jy="px")

    sigma: float = fields.quantity("px", "standard deviation of the position about 0", default=3.0, above=0)
    tau: float = fields.quantity("s", "correlation time of the position", default=2.0, above=0)
    sigma_jitter: float = fields.quantity("px", "standard deviation of the jitter", default=0.2, above=0)
    tau_jitter: float = fields.quantity("s", "correlation time of the jitter", default=0.076, above=0)

    def one_axis(self, dt: float) -> tuple[Array, Array]:
        """Return F and Q (2, 2)."""
        (F, Q), (Fj, Qj) = fading(self.tau, self.sigma, dt), fading(self.tau_jitter, self.sigma_jitter, dt)
        return apart(F, Fj), apart(Q, Qj)
