"""Seeds, which give the same generator at every request, for one run or for many; and the generator that refuses to draw."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, final, runtime_checkable

import numpy as np
from attrs import frozen

from vedette.errors import VedetteError
from vedette.units import short
from vedette.values import maker


@runtime_checkable
class Seeds(Protocol):
    """All randomness of many runs in lock-step."""

    def generator(self, step: int, /) -> np.random.Generator:
        """Return the generator of one step, whose draws lead with the runs, each with its own numbers."""


@final
@frozen
class Seed:
    """All randomness of one run: entropy and spawn key as numpy's SeedSequence has them, and a generator for each step."""

    entropy: int | tuple[int, ...]
    key: tuple[int, ...] = ()

    @classmethod
    def of(cls, seed: int | np.random.Generator | np.random.SeedSequence | Seed | Seeds) -> Seed | Seeds:
        """Return the seed meant: of a Generator, the next whole number that it draws; a seed as it is."""
        if isinstance(seed, Seeds):
            return seed
        if isinstance(seed, np.random.Generator):
            return cls(int(seed.integers(2**63)))
        try:
            given = seed if isinstance(seed, np.random.SeedSequence) else np.random.SeedSequence(seed)
        except (TypeError, ValueError):
            raise ValueError(f"seed: must be a whole number >= 0, or a Generator of numpy, got {short(seed)}") from None
        entropy = given.entropy
        whole = tuple(map(int, entropy)) if isinstance(entropy, Sequence) else int(entropy or 0)
        return new_seed(whole, tuple(given.spawn_key))

    def generator(self, step: int) -> np.random.Generator:
        """Return the generator of one step, from its beginning; this takes some 12 us."""
        return np.random.Generator(np.random.PCG64(np.random.SeedSequence(self.entropy, spawn_key=(*self.key, step))))


new_seed = maker(Seed)

_ALL = {name for name in dir(np.random.Generator) if name[0] != "_"}


class NotInLockStep(VedetteError):
    """A draw that is not possible for each run from its own stream."""


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
