"""The common part of models whose axes move alike and independently."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np
from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, fields

POSITION_VELOCITY = Space.of(x="m", y="m", vx="m/s", vy="m/s")

_DERIVATIVES = (("", "m"), ("v", "m/s"), ("a", "m/s^2"))


def over_axes(block: Array, count: int) -> Array:
    """Map a matrix (p, p) over one axis' derivatives to (p count, p count) over x, y, .. vx, vy, .., alike for all axes."""
    p, axes = len(block), range(count)
    whole = np.zeros((p, count, p, count))
    whole[:, axes, :, axes] = block
    return whole.reshape(p * count, p * count)


def white_acceleration(sigma: float, dt: float) -> Array:
    """Return the covariance (2, 2) of one axis' position and velocity after `dt` of white-noise acceleration.

    `sigma`: root of the spectral density, standard deviation of the velocity gained in 1 s.
    """
    q = sigma**2
    return np.array([[q * dt**3 / 3, q * dt**2 / 2], [q * dt**2 / 2, q * dt]])


def white_jerk(sigma: float, dt: float) -> Array:
    """Return the covariance (3, 3) of one axis' position, velocity and acceleration after `dt` of white-noise jerk.

    `sigma`: root of the spectral density, standard deviation of the acceleration gained in 1 s.
    """
    q = sigma**2
    position, mixed, velocity = q * dt**5 / 20, q * dt**4 / 8, q * dt**3
    return np.array(
        [[position, mixed, velocity / 6], [mixed, velocity / 3, q * dt**2 / 2], [velocity / 6, q * dt**2 / 2, q * dt]]
    )


def free_flight(derivatives: int, dt: float) -> Array:
    """Return one axis' transition (p, p), p of 1 to 3, where the highest derivative is constant."""
    return np.array([[1.0, dt, dt**2 / 2], [0.0, 1.0, dt], [0.0, 0.0, 1.0]])[:derivatives, :derivatives]


def check_names(name: str, given: tuple[str, ...]) -> None:
    """Raise ValueError unless there is at least one name, none of them empty or given twice."""
    if not given or not all(given) or len(set(given)) < len(given):
        raise ValueError(f"{name}: must name at least one axis, each once, got {list(given)}")


def _state(self: PerAxis) -> Space:
    check_names("axes", self.axes)
    kept = _DERIVATIVES[: self.derivatives]
    return Space.of(**{prefix + axis: unit for prefix, unit in kept for axis in self.axes})


@frozen(kw_only=True)
class PerAxis(MotionModel):
    """A linear model of one axis, repeated over any number of axes: x, y, vx, vy in the plane, x, y, z, vx .. in space."""

    linear: ClassVar[bool] = True
    derivatives: ClassVar[int]

    axes: tuple[str, ...] = fields.words("the position axes, which move alike, each by itself", default=("x", "y"))
    state: Space = field(init=False, repr=False, eq=False, default=Factory(_state, takes_self=True))

    @abstractmethod
    def transition(self, dt: float) -> Array:
        """Return F over one axis' position and derivatives (p, p)."""

    @abstractmethod
    def covariance(self, dt: float) -> Array:
        """Return Q over one axis' position and derivatives (p, p)."""

    def move(self, x: Array, dt: float) -> Array:
        """Return the state `dt` s later: (*b, n) -> (*b, n)."""
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        """Return F (n, n)."""
        return over_axes(self.transition(dt), len(self.axes))

    def noise(self, x: Array, dt: float) -> Array:
        """Return Q (n, n)."""
        return over_axes(self.covariance(dt), len(self.axes))
