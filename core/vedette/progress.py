"""Progress display: it wraps a loop, in commands and in Python alike."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol, TypeVar

T = TypeVar("T")


class Progress(Protocol):
    """Wraps the items of a loop, with a word on what they are, and yields them one by one as the work goes on."""

    def __call__(self, items: Sequence[T], about: str, /) -> Iterable[T]: ...


def silent(items: Sequence[T], about: str, /) -> Iterable[T]:
    """Show nothing."""
    return items
