"""Modes that hold one velocity in axes of their own: what a mixture must be told of them."""

from __future__ import annotations

from collections.abc import Container, Sequence

from vedette import Axis, Space
from vedette.units import spellings


def velocity_problem(modes: Sequence[Space], stated: Container[str]) -> str | None:
    """Say which axes are not stated of two modes with axes of which each lacks a velocity of the other, or return None."""
    for j, other in enumerate(modes):
        for i, one in enumerate(modes[:j]):
            mine, its = _lacks(other, one), _lacks(one, other)
            unstated = [axis.name for axis in (*mine, *its) if axis.name not in stated]
            if unstated and any(map(_is_velocity, mine)) and any(map(_is_velocity, its)):
                return (
                    f"modes[{i}] moves by {_named(mine)}, modes[{j}] by {_named(its)}: each would take over the other's "
                    f"velocity as certainly 0; state [mean, standard deviation] of {', '.join(unstated)} in the mode that "
                    f"lacks it, or better, give both modes the same axes"
                )
    return None


def _lacks(space: Space, other: Space) -> list[Axis]:
    """Return the velocities, and the axes that wrap, of the other that are not in a space."""
    return [axis for axis in other.axes if axis.name not in space and (axis.period or _is_velocity(axis))]


def _is_velocity(axis: Axis) -> bool:
    length, _, time = axis.unit.partition("/")
    return axis.unit in spellings("m/s") or (length in (*spellings("m"), "px") and time in spellings("s"))


def _named(axes: Sequence[Axis]) -> str:
    return ", ".join(axis.name for axis in axes)
