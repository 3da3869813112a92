"""Parts of a long study that are kept as they are done, so that it can go on after an interrupt."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol, TypeVar

R = TypeVar("R")


class Keep(Protocol):
    """Returns the part of a study that is kept under a name, or makes and keeps it.

    `kind` is the part's class, an attrs class whose fields are arrays, or None where there is none.
    """

    def __call__(self, name: str, kind: type[R], make: Callable[[], R], /) -> R: ...


def afresh(name: str, kind: type[R], make: Callable[[], R], /) -> R:
    """Make the part and keep nothing."""
    return make()
