"""The common part of models whose axes have no derivatives."""

from __future__ import annotations

from typing import Protocol

from vedette import Space
from vedette_standard.motion.blocks import check_names

UNITS = ("m", "m/s", "rad", "rad/s", "s", "1")
"""Units of what may drift: positions, and biases of measurements."""


class _Drifting(Protocol):
    @property
    def axes(self) -> tuple[str, ...]: ...

    @property
    def unit(self) -> str: ...


def drifting(model: _Drifting) -> Space:
    """Return the state of a model with `axes` in one `unit`. An angle does not wrap: it is a small difference."""
    check_names("axes", model.axes)
    return Space.of(**dict.fromkeys(model.axes, model.unit))
