"""Section 4.1 of the paper: an acceleration in fixed axes, and along the target's own velocity."""

from __future__ import annotations

import numpy as np
from attrs import frozen

from vedette import Array

SECONDS = 10_000
LAGS = 100
SPEED = 400.0
STEPS = {"scenario 1": (5.0, 5.0), "scenario 2": (1.7, 0.0425)}
"""Standard deviations of the accelerations' steps per second; m/s^2, the last a turn rate in rad/s."""


@frozen(eq=False)
class Accelerations:
    """One scenario's accelerations in m/s^2, (r, s, 2): fixed along x and y, own along and right of the velocity."""

    fixed: Array
    own: Array


def pieces(count: int, rng: np.random.Generator, seconds: float = 10.0) -> Array:
    """Draw two random walks (count, s, 2) with steps of 1, each from 0 for Poisson(10) s, then at rest as long, and so on.

    Each of the two has times of its own, as in the paper, where the target accelerates along each axis by itself.
    """
    walks = np.empty((count, 2, SECONDS))
    for row in walks.reshape(-1, SECONDS):
        lengths = rng.poisson(seconds, size=int(2.5 * SECONDS / seconds))
        begin = np.cumsum(lengths) - lengths
        on, first = (np.repeat(values, lengths)[:SECONDS] for values in (np.arange(len(lengths)) % 2 == 0, begin))
        steps = np.where(on, rng.standard_normal(SECONDS), 0.0)
        total = np.cumsum(steps)
        row[:] = np.where(on, total - total[first] + steps[first], 0.0)
    return np.moveaxis(walks, 1, 2)


def along_axes(accel: Array) -> Accelerations:
    """Simulate scenario 1: `accel` (r, s, 2) drives the target along x and y; it starts at 400 m/s along x."""
    velocity = np.concatenate([np.zeros_like(accel[:, :1]), np.cumsum(accel[:, :-1], axis=1)], axis=1)
    velocity[..., 0] += SPEED
    return Accelerations(accel, turned(accel, velocity))


def along_velocity(walks: Array) -> Accelerations:
    """Simulate scenario 2: walks (r, s, 2) of the forward acceleration and of the turn rate."""
    forward, rate = walks[..., 0], walks[..., 1]
    speed = SPEED + np.concatenate([np.zeros_like(forward[:, :1]), np.cumsum(forward[:, :-1], axis=1)], axis=1)
    heading = np.concatenate([np.zeros_like(rate[:, :1]), np.cumsum(rate[:, :-1], axis=1)], axis=1)
    direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    left = np.stack([-direction[..., 1], direction[..., 0]], axis=-1)
    accel = forward[..., None] * direction + (speed * rate)[..., None] * left
    return Accelerations(accel, turned(accel, speed[..., None] * direction))


def turned(accel: Array, velocity: Array) -> Array:
    """Return the components along the velocity and to its right: (*b, 2), (*b, 2) -> (*b, 2)."""
    unit = velocity / np.maximum(np.linalg.norm(velocity, axis=-1, keepdims=True), 1e-9)
    right = unit[..., 0] * -accel[..., 1] + unit[..., 1] * accel[..., 0]
    return np.stack([np.sum(unit * accel, axis=-1), right], axis=-1)


def correlation(pair: Array) -> Array:
    """Return the cross-correlation coefficient of two series (r, s, 2) at lags -100 ... 100: (r, 201)."""
    centred = pair - np.mean(pair, axis=1, keepdims=True)
    size = SECONDS + LAGS  # what is farther apart wraps around to no lag that is returned
    first, second = (np.fft.rfft(centred[..., j], size) for j in (0, 1))
    product = np.fft.irfft(first * np.conj(second), size)
    rho = np.concatenate([product[:, -LAGS:], product[:, : LAGS + 1]], axis=1)
    scale = np.sqrt(np.prod(np.sum(centred**2, axis=1), axis=-1))
    return rho / scale[:, None]


def kurtosis(values: Array) -> Array:
    """Return the fourth central moment over the squared variance, 3 for a Gaussian: (r, s) -> (r,)."""
    centred = values - np.mean(values, axis=1, keepdims=True)
    return np.mean(centred**4, axis=1) / np.mean(centred**2, axis=1) ** 2


@frozen(eq=False)
class Measured:
    """Of each of r trajectories: correlations along x and y, and forward and aside (r, 201); kurtosis and variance (r, 4).

    The four are x, y, forward, aside; `first` (s, 4) are their series in the first trajectory.
    """

    across_axes: Array
    across_own: Array
    kurtosis: Array
    variance: Array
    first: Array


def measured(part: Accelerations) -> Measured:
    """Measure one scenario's accelerations."""
    four = np.concatenate([part.fixed, part.own], axis=-1)
    peaked = np.stack([kurtosis(four[..., j]) for j in range(4)], axis=-1)
    return Measured(correlation(part.fixed), correlation(part.own), peaked, np.var(four, axis=1), four[0])


def study(count: int, rng: np.random.Generator, seconds: float = 10.0) -> dict[str, Accelerations]:
    """Simulate both scenarios, `count` trajectories each, and white noise for comparison."""
    first = along_axes(np.array(STEPS["scenario 1"]) * pieces(count, rng, seconds))
    second = along_velocity(np.array(STEPS["scenario 2"]) * pieces(count, rng, seconds))
    white = rng.standard_normal((count, SECONDS, 2))
    return {"scenario 1": first, "scenario 2": second, "white noise": Accelerations(white, white)}
