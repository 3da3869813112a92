"""The generator that refuses to be drawn from, and the error of draws that cannot be made run by run."""

from __future__ import annotations

from typing import Any, final

import numpy as np

from vedette.errors import VedetteError

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
