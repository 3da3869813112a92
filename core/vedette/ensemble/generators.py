"""One generator for many runs, of which each draws from its own stream."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vedette.space import Array


class Generators(np.random.Generator):
    """Draws of shape (r, ...) whose row i comes from the i-th seed alone, for estimators that draw in lock-step.

    Streams are made when they are first drawn from. They differ from those of the scene, which the same seeds give.
    """

    def __init__(self, seeds: Sequence[np.random.SeedSequence]) -> None:
        super().__init__(np.random.PCG64(0))
        self._seeds = tuple(seeds)
        self._streams: list[np.random.Generator] = []

    def _each(self) -> list[np.random.Generator]:
        if not self._streams:
            own = [np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, 1)) for seed in self._seeds]
            self._streams = [np.random.Generator(np.random.PCG64(seed)) for seed in own]
        return self._streams

    def random(self, size: Any = None, *_: Any, **__: Any) -> Array:  # type: ignore[override]
        """Uniform in [0, 1)."""
        return np.stack([stream.random(self._row(size)) for stream in self._each()])

    def standard_normal(self, size: Any = None, *_: Any, **__: Any) -> Array:  # type: ignore[override]
        """Standard normal."""
        return np.stack([stream.standard_normal(self._row(size)) for stream in self._each()])

    def _row(self, size: Any) -> tuple[int, ...]:
        shape = tuple(size) if isinstance(size, tuple | list) else (size,)
        if shape[0] != len(self._seeds):
            raise ValueError(f"size: must lead with the {len(self._seeds)} runs, got {size}")
        return shape[1:]
