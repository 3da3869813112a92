"""The common part of models whose axes move alike and independently."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, TypeAlias

from attrs import Factory, field, frozen

from vedette import Array, MotionModel, Space, fields, kernels

POSITION_VELOCITY: Space = Space.of(x="m", y="m", vx="m/s", vy="m/s")

_DERIVATIVES = (("", "m"), ("v", "m/s"), ("a", "m/s^2"))


Block: TypeAlias = Array | tuple[tuple[float, ...], ...]
"""A matrix over one axis' derivatives. As rows of floats it is quickly made, as each new time step needs it."""


def white_acceleration(sigma: float, dt: float) -> Block:
    """Return the covariance (2, 2) of one axis' position and velocity after `dt` of white-noise acceleration.

    `sigma`: root of the spectral density, standard deviation of the velocity gained in 1 s.
    """
    q = sigma**2
    mixed = q * dt**2 / 2
    return (q * dt**3 / 3, mixed), (mixed, q * dt)


def white_jerk(sigma: float, dt: float) -> Block:
    """Return the covariance (3, 3) of one axis' position, velocity and acceleration after `dt` of white-noise jerk.

    `sigma`: root of the spectral density, standard deviation of the acceleration gained in 1 s.
    """
    q = sigma**2
    position, mixed, velocity, last = q * dt**5 / 20, q * dt**4 / 8, q * dt**3, q * dt**2 / 2
    return (position, mixed, velocity / 6), (mixed, velocity / 3, last), (velocity / 6, last, q * dt)


def free_flight(derivatives: int, dt: float) -> Block:
    """Return one axis' transition (p, p), p of 2 or 3, where the highest derivative is constant."""
    if derivatives == 2:
        return (1.0, dt), (0.0, 1.0)
    return (1.0, dt, dt**2 / 2), (0.0, 1.0, dt), (0.0, 0.0, 1.0)


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
    def transition(self, dt: float) -> Block:
        """Return F over one axis' position and derivatives (p, p)."""

    @abstractmethod
    def covariance(self, dt: float) -> Block:
        """Return Q over one axis' position and derivatives (p, p)."""

    def move(self, x: Array, dt: float) -> Array:
        return x @ self.jacobian(x, dt).T

    def jacobian(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(self.transition(dt), len(self.axes))

    def noise(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(self.covariance(dt), len(self.axes))
