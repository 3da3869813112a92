"""The target-oriented model on a plain Cartesian state."""

from __future__ import annotations

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import Array, MotionModel, Space, fields
from vedette_target_oriented.along_velocity import chord, held_gain

_STATE = Space.of(x="m", y="m", vx="m/s", vy="m/s")


@final
@frozen
class TargetOriented(MotionModel):
    """Acceleration noise along and across the target's own velocity, and a known acceleration to its right that turns it.

    Velocity v = vx + i vy, speed s, turns by d = -side_accel T/s; the position gains T A(d) v, A(d) = (exp(i d) - 1)/(i d).
    The noise is an acceleration held for T: Q = G D G', G = [T^2/2; T], D = sigma_forward^2 f f' + sigma_side^2 (I - f f').
    A filter with a covariance takes its mean over the heading's variance.
    The derivative by v holds that of d as well, d' = -d v/s^2: i exp(i d) v d' of the velocity and T A'(d) v d' of the
    position. So the covariance turns with the velocity and nothing is reset: this is exactly the paper's model with
    velocity and covariance rotated into the frame of the new velocity after each scan.
    Below `slowest` the heading is ill-defined: turns are those at that speed, and D tends to its mean over all
    directions, reached at rest.
    Yoon, Ko, a manoeuvring target tracking algorithm with a target-oriented velocity representation (in Korean).

    >>> model, T, v = TargetOriented(sigma_forward=2.0, sigma_side=5.0, side_accel=1.5), 3.0, 8.0 - 6.0j  # 10 m/s
    >>> w = -1.5 / 10.0  # to the right, rad/s
    >>> at, turned = (np.exp(1j * w * T) - 1.0) / (1j * w) * v, np.exp(1j * w * T) * v
    >>> x = np.array([100.0, 50.0, 8.0, -6.0])
    >>> np.allclose(model.move(x, T), [100.0 + at.real, 50.0 + at.imag, turned.real, turned.imag])
    True
    >>> by_differences = [(model.move(x + d, T) - model.move(x - d, T)) / 2e-6 for d in 1e-6 * np.eye(4)]
    >>> np.allclose(model.jacobian(x, T), np.transpose(by_differences), atol=1e-6)
    True
    >>> ff, G = np.outer([0.8, -0.6], [0.8, -0.6]), np.array([T**2 / 2.0, T])
    >>> D = 4.0 * ff + 25.0 * (np.eye(2) - ff)
    >>> np.allclose(model.noise(x, T), np.kron(np.outer(G, G), D))
    True
    >>> s = 9.0 / 100.0  # variance of the heading, of 9 m^2/s^2 across: what is known of f f' falls by exp(-2 s)
    >>> unsure = 0.5 * np.eye(2) + np.exp(-2.0 * s) * (ff - 0.5 * np.eye(2))
    >>> mean = model.mean_noise(x, np.diag([1.0, 1.0, 9.0, 9.0]), T)
    >>> np.allclose(mean, np.kron(np.outer(G, G), 4.0 * unsure + 25.0 * (np.eye(2) - unsure)))
    True
    >>> np.allclose(model.noise(np.zeros(4), T), np.kron(np.outer(G, G), 14.5 * np.eye(2)))  # at rest, of all directions
    True
    """

    kind: ClassVar[str] = "target_oriented"
    state: ClassVar[Space] = _STATE

    sigma_forward: float = fields.quantity("m/s^2", "standard deviation of the acceleration along the velocity", above=0)
    sigma_side: float = fields.quantity("m/s^2", "standard deviation of the acceleration across the velocity", above=0)
    side_accel: float = fields.quantity(
        "m/s^2", "known acceleration to the right of the velocity, which turns it", default=0.0
    )
    slowest: float = fields.quantity("m/s", "speed below which the heading counts less and less", default=1.0, above=0)

    def _turn(self, x: Array, dt: float) -> tuple[Array, Array, Array]:
        """Return the velocity as a complex number, its speed, at least `slowest`, and the angle it turns by, (*b) each."""
        v = x[..., 2] + 1j * x[..., 3]
        speed = np.maximum(np.abs(v), self.slowest)
        return v, speed, -self.side_accel * dt / speed

    def move(self, x: Array, dt: float) -> Array:
        """Move the state: (*b, 4) -> (*b, 4)."""
        v, _, angle = self._turn(x, dt)
        step, after = dt * chord(angle)[0] * v, np.exp(1j * angle) * v
        moved = x.copy()
        moved[..., 0] += step.real
        moved[..., 1] += step.imag
        moved[..., 2], moved[..., 3] = after.real, after.imag
        return moved

    def jacobian(self, x: Array, dt: float) -> Array:
        v, speed, angle = self._turn(x, dt)
        mean, slope = chord(angle)
        turn = np.exp(1j * angle)
        by_speed = np.where(np.abs(v) > self.slowest, -angle / speed**2, 0.0)
        F = np.zeros((*x.shape, 4))
        F[..., range(4), range(4)] = 1.0
        for column, (unit, part) in enumerate(((1.0, v.real), (1j, v.imag)), start=2):
            step = dt * (mean * unit + slope * v * by_speed * part)
            after = turn * unit + 1j * turn * v * by_speed * part
            F[..., 0, column], F[..., 1, column] = step.real, step.imag
            F[..., 2, column], F[..., 3, column] = after.real, after.imag
        return F

    def noise(self, x: Array, dt: float) -> Array:
        return self._held(x, np.ones(x.shape[:-1]), dt)

    def mean_noise(self, x: Array, cov: Array, dt: float) -> Array:
        """Return the mean of Q over a belief: (*b, 4), (*b, 4, 4) -> (*b, 4, 4).

        The heading's variance is s = n' P n / speed^2, n across the velocity; for a Gaussian heading the mean of f f' - I/2
        is exp(-2 s) times that at the mean. With Q at the mean alone the filter takes its heading for certain.
        """
        v, speed, _ = self._turn(x, dt)
        across = np.stack([-x[..., 3], x[..., 2]], axis=-1) / np.maximum(np.abs(v), 1e-300)[..., None]
        variance = np.einsum("...i,...ij,...j->...", across, cov[..., 2:, 2:], across) / speed**2
        return self._held(x, np.exp(-2 * variance), dt)

    def _held(self, x: Array, sure: Array, dt: float) -> Array:
        """Return Q with f f' - I/2 times `sure` (*b), from 1 for a certain heading to 0 for none."""
        _, speed, _ = self._turn(x, dt)
        unit = x[..., 2:] / speed[..., None]
        known = 0.5 * np.minimum(np.sum(unit**2, axis=-1), 1.0)[..., None, None] * np.eye(2)
        along = unit[..., :, None] * unit[..., None, :] - known
        position, cross, velocity = held_gain(
            0.5 * np.eye(2) + sure[..., None, None] * along, self.sigma_forward, self.sigma_side, dt
        )
        Q = np.empty((*x.shape, 4))
        Q[..., :2, :2], Q[..., 2:, 2:] = position, velocity
        Q[..., :2, 2:] = Q[..., 2:, :2] = cross
        return Q
