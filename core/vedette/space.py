"""Named axes with units and periods: the only place where angles wrap.

>>> polar = Space.of(range="m", bearing="rad mod 2pi")
>>> polar.difference(np.array([10.0, 3.1]), np.array([9.0, -3.1])).round(4).tolist()
[1.0, -0.0832]
"""

from __future__ import annotations

from typing import Any, Self

import numpy as np
from attrs import Factory, field, frozen
from numpy.typing import NDArray

Array = NDArray[np.floating[Any]]
"""Real numbers in double precision, any shape, which the docstring states."""
Mask = NDArray[np.bool_]
"""Booleans, any shape."""
Indices = NDArray[np.int64]
"""Whole numbers, such as rows, any shape."""


Periods = tuple[tuple[int, float], ...]
"""Index and period of the axes that wrap."""


def wrapped(x: Array, periods: Periods) -> Array:
    """Return `x` (*b, n) with each axis of `periods`, index and period, in [-period/2, period/2); a copy if there is any."""
    if periods:
        x = x.copy()
        for i, period in periods:
            # No whole turn is subtracted from a value that is already inside: it stays bit-identical.
            half = period / 2
            near = x[..., i] - period * np.rint(x[..., i] / period)
            x[..., i] = np.where(near < half, np.maximum(near, -half), -half)
    return x


class SpaceError(ValueError):
    """Requested axes are missing, or two spaces state an axis differently."""


@frozen
class Axis:
    """One coordinate: its name, its unit, and its period if it wraps (2 pi for a bearing in rad)."""

    name: str
    unit: str = "1"
    period: float | None = None

    def __str__(self) -> str:
        wraps = "" if self.period is None else f" mod {self.period:.6g}"
        return f"{self.name} [{self.unit}{wraps}]"


def _periods(space: Space) -> Periods:
    return tuple((i, axis.period) for i, axis in enumerate(space.axes) if axis.period is not None)


@frozen
class Space:
    """An ordered set of axes. Vectors over it have shape (*b, len(space)).

    A periodic axis is canonical in [-period/2, period/2); `periods` holds the index and the period of each.
    """

    axes: tuple[Axis, ...] = ()
    _index: dict[str, int] = field(
        init=False,
        repr=False,
        eq=False,
        default=Factory(lambda self: {axis.name: i for i, axis in enumerate(self.axes)}, takes_self=True),
    )
    periods: Periods = field(init=False, repr=False, eq=False, default=Factory(_periods, takes_self=True))

    def __attrs_post_init__(self) -> None:
        if len(self._index) != len(self.axes):
            raise SpaceError(f"an axis is named twice in {self}")

    @classmethod
    def of(cls, **units: str) -> Self:
        """Build from `name="unit"`; `"rad mod 2pi"` makes an axis that wraps."""
        axes = []
        for name, unit in units.items():
            plain, _, period = unit.partition(" mod ")
            if period not in ("", "2pi"):
                other = f"any other is stated by Space((Axis({name!r}, 'deg', 360.0),))"
                raise SpaceError(f"{name}: the period must be '2pi', got {period!r}; {other}")
            axes.append(Axis(name, plain, 2 * np.pi if period else None))
        return cls(tuple(axes))

    def __len__(self) -> int:
        return len(self.axes)

    def __contains__(self, name: str) -> bool:
        return name in self._index

    def __str__(self) -> str:
        return "(" + ", ".join(map(str, self.axes)) + ")"

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._index)

    def locate(self, part: Space) -> list[int]:
        """Return the indices of the axes of `part`; SpaceError, with both lists, if one is missing or different here."""
        index = self._index
        try:
            where = [index[axis.name] for axis in part.axes]
        except KeyError as missing:
            raise SpaceError(f"axis {missing.args[0]!r} of {part} is not among {self}") from None
        for i, axis in zip(where, part.axes, strict=True):
            if (here := self.axes[i]).unit != axis.unit or here.period != axis.period:
                raise SpaceError(f"axis {axis} of {part} is {here} among {self}")
        return where

    def union(self, other: Space) -> Space:
        """Return the axes of both, this space's first; SpaceError if they state one axis differently."""
        for axis in other.axes:
            if axis.name in self and self.axes[self._index[axis.name]] != axis:
                raise SpaceError(f"axis {axis} is {self.axes[self._index[axis.name]]} elsewhere")
        return Space(self.axes + tuple(axis for axis in other.axes if axis.name not in self))

    def canonical(self, x: Array) -> Array:
        """Return `x` (*b, n) with each periodic axis wrapped to [-period/2, period/2); a copy only if one is."""
        return wrapped(x, self.periods)

    def difference(self, a: Array, b: Array) -> Array:
        """Return `a` minus `b` (*b, n), wrapped on periodic axes."""
        return self.canonical(a - b)

    def displace(self, x: Array, step: Array) -> Array:
        """Return `x` (*b, n) moved by `step` (*b, n), canonical."""
        return self.canonical(x + step)

    def mean(self, points: Array, weights: Array) -> tuple[Array, Array]:
        """Return the mean (*b, n) of `points` (*b, s, n) under `weights` (*b, s), and each point's difference from it.

        It is taken around the first point, so it is right on a circle while the points span less than half of it.
        """
        if not self.periods:
            mean: Array = (weights[..., None, :] @ points)[..., 0, :]
            return mean, points - mean[..., None, :]
        origin = points[..., :1, :]
        shift = (weights[..., None, :] @ self.difference(points, origin))[..., 0, :]
        mean = self.displace(origin[..., 0, :], shift)
        return mean, self.difference(points, mean[..., None, :])


NO_AXES = Space()
"""The space without axes."""
