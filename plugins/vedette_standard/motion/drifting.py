"""The common part of models whose axes have no derivatives."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Protocol

from attrs import frozen

from vedette import Array, MotionModel, Space, kernels
from vedette_standard.motion.blocks import check_names

UNITS: tuple[str, ...] = ("m", "m/s", "rad", "rad/s", "s", "1")
"""Units of what may drift: positions, and biases of measurements."""


class _Drifting(Protocol):
    @property
    def axes(self) -> tuple[str, ...]: ...

    @property
    def unit(self) -> str: ...


def drifting(model: _Drifting) -> Space:
    """Return the state of a model with `axes` in one `unit`. An angle in rad does not wrap: it is a small difference."""
    check_names("axes", model.axes)
    return Space.of(**dict.fromkeys(model.axes, model.unit))


@frozen
class Wandering(MotionModel):
    """A model whose axes are expected to stay as they are; a subclass says by how much they do not."""

    linear: ClassVar[bool] = True

    @property
    @abstractmethod
    def state(self) -> Space:
        """Return the axes."""

    def move(self, x: Array, dt: float) -> Array:
        return x

    def jacobian(self, x: Array, dt: float) -> Array:
        return kernels.over_axes(((1.0,),), len(self.state))
