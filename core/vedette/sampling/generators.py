"""Generators other than one stream: one for many runs, and one that refuses to be drawn from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, final

import numpy as np

from vedette import kernels
from vedette.errors import VedetteError
from vedette.space import Array

_ALL = {name for name in dir(np.random.Generator) if name[0] != "_"}
_LAW = "draws of runs in lock-step are `random` and `standard_normal` whose size leads with the runs"
_ROWS = {"random": "_uniforms", "standard_normal": "_normals"}
_OTHERS = _ALL - set(_ROWS)


class NotInLockStep(VedetteError):
    """A draw that is not possible for each run from its own stream."""


class Generators(np.random.Generator):
    """Draws of shape (r, ...) whose row i comes from the i-th run's stream alone, for estimators that draw in lock-step.

    NotInLockStep for any other draw: shared numbers would make a run depend on the others. `streams` makes
    the generators of the runs when they are first drawn from.
    """

    def __init__(self, runs: int, streams: Callable[[], Sequence[np.random.Generator]]) -> None:
        super().__init__(np.random.PCG64(0))
        self._runs = runs
        self._make = streams
        self._streams: Sequence[np.random.Generator] = ()

    def __getattribute__(self, name: str) -> Any:
        if name in _OTHERS:
            raise NotInLockStep(f"{name}: {_LAW}")
        return super().__getattribute__(_ROWS.get(name, name))

    def __str__(self) -> str:
        return f"generators of {self._runs} runs"

    __repr__ = __str__

    def _uniforms(self, size: Any = None) -> Array:
        """Draw uniform numbers in [0, 1)."""
        return kernels.uniforms(self._each(), self._own(size))

    def _normals(self, size: Any = None) -> Array:
        """Draw standard normal numbers."""
        return kernels.normals(self._each(), self._own(size))

    def _each(self) -> Sequence[np.random.Generator]:
        if not self._streams:
            self._streams = self._make()
        return self._streams

    def _own(self, size: Any) -> tuple[int, ...]:
        """Return the shape of what each run draws."""
        shape = tuple(size) if isinstance(size, tuple | list) else (size,)
        if not shape or shape[0] != self._runs:
            raise NotInLockStep(f"size: {_LAW}, {self._runs} of them; got {size}")
        return shape[1:]


@final
class _NoDraws(np.random.Generator):
    """What components get that do not declare that they draw: TypeError for any draw."""

    def __getattribute__(self, name: str) -> Any:
        if name in _ALL:
            raise TypeError(f"rng.{name}: this component draws random numbers but does not declare `Traits(draws=True)`")
        return super().__getattribute__(name)

    def __str__(self) -> str:
        return "no draws"

    __repr__ = __str__


NO_DRAWS = _NoDraws(np.random.PCG64(0))
"""The generator for components that draw nothing: it costs nothing, and refuses."""
