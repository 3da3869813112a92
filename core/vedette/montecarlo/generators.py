"""One generator for many runs, of which each draws from its own stream."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette import kernels
from vedette.errors import VedetteError
from vedette.montecarlo.seeds import Seeds
from vedette.space import Array

_LAW = "draws of runs in lock-step are `random` and `standard_normal` whose size leads with the runs"
_OTHERS = {name for name in dir(np.random.Generator) if name[0] != "_"} - {"random", "standard_normal"}


class NotInLockStep(VedetteError):
    """A draw that cannot be had for each run from its own stream."""


class Generators(np.random.Generator):
    """Draws of shape (r, ...) whose row i comes from the i-th run's seed alone, for estimators that draw in lock-step.

    NotInLockStep for any other draw: numbers that the runs share would make a run depend on its company. Streams are made
    when they are first drawn from. They differ from those of the scene, which the same seeds give.
    """

    def __init__(self, seeds: Seeds) -> None:
        super().__init__(np.random.PCG64(0))
        self._seeds = seeds.child(1)
        self._streams: list[np.random.Generator] = []

    def __getattribute__(self, name: str) -> Any:
        if name in _OTHERS:
            raise NotInLockStep(f"{name}: {_LAW}")
        return super().__getattribute__(name)

    def __str__(self) -> str:
        return f"generators of {len(self._seeds.runs)} runs"

    __repr__ = __str__

    def random(self, size: Any = None) -> Array:  # type: ignore[override]
        """Uniform in [0, 1)."""
        return kernels.uniforms(self._each(), self._own(size))

    def standard_normal(self, size: Any = None) -> Array:  # type: ignore[override]
        """Standard normal."""
        return kernels.normals(self._each(), self._own(size))

    def _each(self) -> list[np.random.Generator]:
        if not self._streams:
            self._streams = self._seeds.generators()
        return self._streams

    def _own(self, size: Any) -> tuple[int, ...]:
        """What each run draws of a size."""
        shape = tuple(size) if isinstance(size, tuple | list) else (size,)
        if not shape or shape[0] != len(self._seeds.runs):
            raise NotInLockStep(f"size: {_LAW}, {len(self._seeds.runs)} of them; got {size}")
        return shape[1:]
