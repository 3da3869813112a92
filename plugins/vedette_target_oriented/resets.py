"""The paper's frame: forward and side speed along a heading given by the last two combined positions."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from attrs import evolve, frozen

from vedette import Array, Gaussian, MotionModel, Space, fields

ZERO_VARIANCE = Space.of(heading="rad mod 2pi", last_x="m", last_y="m")
STATE = Space(Space.of(x="m", y="m", v_forward="m/s", v_side="m/s").axes + ZERO_VARIANCE.axes)


@frozen
class ResettingMotion(MotionModel):
    """x, y, v_forward, v_side, the last to the right; heading and the last position are axes without variance.

    Before each step, heading = atan2 of the displacement between the last two combined positions, and v_side is reset; if
    they coincide, the heading stays. F = I + T [0 B; 0 0] with B = [cos sin; sin -cos] of the heading;
    Q = G diag(sigma_forward^2, sigma_side^2) G', G = [B T^2/2; I T]. What the reset does to the covariance is left open.
    Yoon, Ko, a manoeuvring target tracking algorithm with a target-oriented velocity representation (in Korean).
    """

    reframes: ClassVar[bool] = True
    state: ClassVar[Space] = STATE
    zero_variance: ClassVar[Space] = ZERO_VARIANCE

    sigma_forward: float = fields.quantity("m/s^2", "standard deviation of the forward acceleration", above=0)
    sigma_side: float = fields.quantity("m/s^2", "standard deviation of the side acceleration", above=0)
    side_speed: float = fields.quantity("m/s", "v_side after each scan: a turn to the right if positive", default=0.0)

    @abstractmethod
    def reset(self, cov: Array) -> Array:
        """Return the covariance (*b, 7, 7) once v_side is set."""

    def steer(self, before: Array, now: Array) -> Array:
        """Return the heading from the one before and the direction of the last two positions: (*b), (*b) -> (*b)."""
        return now

    def move(self, x: Array, dt: float) -> Array:
        """Move the state: (*b, 7) -> (*b, 7)."""
        moved = x.copy()
        moved[..., :2] += dt * (basis(x[..., 4]) @ x[..., 2:4, None])[..., 0]
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        F = np.zeros((*x.shape, 7))
        F[..., range(7), range(7)] = 1.0
        F[..., :2, 2:4] = dt * basis(x[..., 4])
        way = F[..., :2, 2:4] @ x[..., 2:4, None]
        F[..., 0, 4], F[..., 1, 4] = -way[..., 1, 0], way[..., 0, 0]
        return F

    def noise(self, x: Array, dt: float) -> Array:
        B, sigma = basis(x[..., 4]), np.array([self.sigma_forward, self.sigma_side])
        variance, gained = sigma**2, B * sigma * (dt**2 / 2)
        Q = np.zeros((*x.shape, 7))
        Q[..., :2, :2] = gained @ np.swapaxes(gained, -1, -2)
        Q[..., :2, 2:4] = B * variance * (dt**3 / 2)
        Q[..., 2:4, :2] = np.swapaxes(Q[..., :2, 2:4], -1, -2)
        Q[..., 2, 2], Q[..., 3, 3] = variance * dt**2
        return Q

    def reframe(self, own: Gaussian, combined: Gaussian) -> Gaussian:
        """Take heading and last position from the combined estimate, set v_side, and leave the covariance to `reset`."""
        way = combined.mean[..., :2] - combined.mean[..., 5:7]
        moved = np.any(way != 0, axis=-1)
        mean = own.mean.copy()
        mean[..., 3] = self.side_speed
        before = combined.mean[..., 4]
        mean[..., 4] = np.where(moved, self.steer(before, np.arctan2(way[..., 1], way[..., 0])), before)
        mean[..., 5:7] = combined.mean[..., :2]
        return evolve(own, mean=STATE.canonical(mean), cov=self.reset(own.cov))


def basis(heading: Array) -> Array:
    """Return unit vectors forward and to the right as columns: (*b) -> (*b, 2, 2)."""
    cos, sin = np.cos(heading), np.sin(heading)
    B = np.empty((*heading.shape, 2, 2))
    B[..., 0, 0], B[..., 0, 1] = cos, sin
    B[..., 1, 0], B[..., 1, 1] = sin, -cos
    return B


_PLANE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


def in_frame(prior: Gaussian, last: Array) -> Gaussian:
    """Convert a prior over x, y, vx, vy (*b, 4) to the frame along its velocity (*b, 7); `last` (*b, 2): last position."""
    heading = np.arctan2(prior.mean[..., 3], prior.mean[..., 2])
    turn = np.zeros((*heading.shape, 4, 4))
    turn[..., range(2), range(2)] = 1.0
    turn[..., 2:, 2:] = np.swapaxes(basis(heading), -1, -2)
    mean, cov = np.zeros((*heading.shape, 7)), np.zeros((*heading.shape, 7, 7))
    mean[..., :4] = (turn @ prior.mean[..., None])[..., 0]
    mean[..., 4], mean[..., 5:7] = heading, last
    cov[..., :4, :4] = turn @ prior.cov @ np.swapaxes(turn, -1, -2)
    return Gaussian(mean, cov)


def cartesian(space: Space, estimate: Gaussian) -> Gaussian:
    """Convert an estimate over `space` to x, y, vx, vy: the axes themselves, or those of the paper's frame turned back."""
    if "heading" not in space:
        axes = space.locate(_PLANE)
        return Gaussian(estimate.mean[..., axes], estimate.cov[..., axes, :][..., axes])
    own = space.locate(STATE)
    mean, cov = estimate.mean[..., own], estimate.cov[..., own[:4], :][..., own[:4]]
    turn = np.zeros((*mean.shape[:-1], 4, 4))
    turn[..., range(2), range(2)] = 1.0
    turn[..., 2:, 2:] = basis(mean[..., 4])
    return Gaussian((turn @ mean[..., :4, None])[..., 0], turn @ cov @ np.swapaxes(turn, -1, -2))
