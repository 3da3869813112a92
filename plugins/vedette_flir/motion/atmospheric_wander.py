"""The truth of the paper: a wandering target behind a third-order atmosphere."""

from __future__ import annotations

import math
from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, Space, fields
from vedette_flir.motion.processes import ImagePlane, apart, fading


@final
@frozen
class AtmosphericWander(ImagePlane):
    """A first-order Gauss-Markov position, and atmospheric jitter by the filter K W1 W2^2 / ((s + W1)(s + W2)^2) per axis.

    In Jordan form j = slow + fast, slow' = -W1 slow + G1 w, fast' = -W2 fast + drive + G2 w, drive' = -W2 drive + G3 w,
    G1 = K W1 W2^2 / (W1 - W2)^2, G2 = -G1, G3 = K W1 W2^2 / (W1 - W2), K such that j has `sigma_jitter`.
    Q is the integral of e^(As) G G' e^(A's) by incomplete gamma functions: Van Loan's matrix exponential, with
    W2 dt = 22 at 30 frames/s, loses all its digits.
    Maybeck, Mercier, A Target Tracker Using Spatially Distributed Infrared Measurements, IEEE T-AC 25, 1980.

    >>> from scipy.linalg import expm, solve_continuous_lyapunov
    >>> model, W1, W2 = AtmosphericWander(sigma=3.0, tau=2.0, sigma_jitter=0.4, corner=3.0, double_corner=8.0), 3.0, 8.0
    >>> G = W1 * W2**2 * np.array([1.0 / (W1 - W2) ** 2, -1.0 / (W1 - W2) ** 2, 1.0 / (W1 - W2)])
    >>> A = np.array([[-W1, 0.0, 0.0], [0.0, -W2, 1.0], [0.0, 0.0, -W2]])
    >>> steady = solve_continuous_lyapunov(A, -np.outer(G, G))
    >>> K = 0.4 / np.sqrt(np.sum(steady[:2, :2]))  # of slow + fast
    >>> F, e = expm(0.5 * A), np.exp(-0.25)
    >>> Q = K**2 * (steady - F @ steady @ F.T)
    >>> x = np.zeros(8)
    >>> np.allclose(model.jacobian(x, 0.5)[2::2, 2::2], F), np.allclose(model.noise(x, 0.5)[2::2, 2::2], Q)
    (True, True)
    >>> np.allclose(model.noise(np.zeros(8), 0.5)[:2, :2], 9.0 * (1.0 - e * e) * np.eye(2))
    True
    >>> np.allclose(model.move(np.arange(8.0), 0.5)[:2], [0.0, e]), np.allclose(model.gains, K * G)
    (True, True)
    """

    kind: ClassVar[str] = "atmospheric_wander"
    space: ClassVar[Space] = Space.of(
        x="px", y="px", slow_x="px", slow_y="px", fast_x="px", fast_y="px", drive_x="px/s", drive_y="px/s"
    )

    sigma: float = fields.quantity("px", "standard deviation of the position about 0", default=3.0, above=0)
    tau: float = fields.quantity("s", "correlation time of the position", default=2.0, above=0)
    sigma_jitter: float = fields.quantity("px", "standard deviation of the jitter", default=0.2, above=0)
    corner: float = fields.quantity("rad/s", "W1, beyond which the jitter falls off", default=14.14, above=0)
    double_corner: float = fields.quantity("rad/s", "W2, the double pole; > W1", default=659.5, above=0)

    def __attrs_post_init__(self) -> None:
        if self.double_corner <= self.corner:
            raise ValueError(f"double_corner: must be > corner, {self.corner:.6g} rad/s, got {self.double_corner:.6g} rad/s")

    @property
    def gains(self) -> tuple[float, float, float]:
        """G1, G2 and G3."""
        a, b = self.corner, self.double_corner
        K = 2.0 * self.sigma_jitter * (a + b) / math.sqrt(a * b * (a + 2.0 * b))
        first = K * a * b**2 / (a - b) ** 2
        return first, -first, K * a * b**2 / (a - b)

    def one_axis(self, dt: float) -> tuple[Array, Array]:
        """Return F and Q (4, 4)."""
        from scipy.special import gammainc

        a, b = self.corner, self.double_corner
        g1, g2, g3 = self.gains

        def moment(power: int, rate: float) -> float:
            """Return the integral of s^power e^(-rate s) over [0, dt]."""
            return math.factorial(power) / rate ** (power + 1) * float(gammainc(power + 1, rate * dt))

        slow = g1 * g1 * moment(0, 2 * a)
        cross = g1 * (g2 * moment(0, a + b) + g3 * moment(1, a + b))
        slow_drive = g1 * g3 * moment(0, a + b)
        fast = g2 * g2 * moment(0, 2 * b) + 2 * g2 * g3 * moment(1, 2 * b) + g3 * g3 * moment(2, 2 * b)
        fast_drive = g3 * (g2 * moment(0, 2 * b) + g3 * moment(1, 2 * b))
        drive = g3 * g3 * moment(0, 2 * b)
        noise = np.array([[slow, cross, slow_drive], [cross, fast, fast_drive], [slow_drive, fast_drive, drive]])
        e = math.exp(-b * dt)
        flow = np.array([[math.exp(-a * dt), 0.0, 0.0], [0.0, e, dt * e], [0.0, 0.0, e]])
        F, Q = fading(self.tau, self.sigma, dt)
        return apart(F, flow), apart(Q, noise)
