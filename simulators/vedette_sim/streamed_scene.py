"""A scene's scans drawn as they are asked for, so that a long one need not fit into memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import final, overload

import numpy as np

from vedette import Array, Scan

BLOCK = 500
"""Scans whose numbers are drawn together."""


@final
class LazyScene(Sequence[Scan]):
    """The `length` scans that `draw` yields, drawn anew in each iteration; to go back is to start from the first."""

    def __init__(self, length: int, draw: Callable[[], Iterator[Scan]]) -> None:
        self._length, self._draw = length, draw
        self._next: Iterator[Scan] = iter(())
        self._place = length
        self._last: Scan | None = None

    def __len__(self) -> int:
        return self._length

    def __iter__(self) -> Iterator[Scan]:
        return self._draw()

    @overload
    def __getitem__(self, index: int) -> Scan: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Scan, ...]: ...
    def __getitem__(self, index: int | slice) -> Scan | tuple[Scan, ...]:
        if isinstance(index, slice):
            return tuple(self[i] for i in range(self._length)[index])
        wanted = range(self._length)[index]
        if self._last is None or wanted < self._place:
            self._next, self._place, self._last = self._draw(), -1, None
        while self._last is None or self._place < wanted:
            self._last = next(self._next)
            self._place += 1
        return self._last


@final
class Views:
    """The random numbers with which one sensor sees the objects of a scene: for each scan one uniform and `m` normal ones.

    An object's numbers are those of `stream(name)`: `count` uniform ones, then `count` times `m` normal ones, as if they
    were drawn whole. Blocks of scans come in order, and what no later block needs is given up.
    """

    def __init__(self, count: int, m: int, stream: Callable[[str], np.random.Generator]) -> None:
        self._count, self._m, self._stream = count, m, stream
        self._streams: dict[str, tuple[np.random.Generator, np.random.Generator]] = {}

    def block(self, names: Sequence[str], begin: int, end: int) -> tuple[Array, Array]:
        """Return the numbers of scans `begin` to `end` for the objects of these names: (j, s) and (j, s, m)."""
        size = end - begin
        uniform, normal = np.empty((len(names), size)), np.empty((len(names), size, self._m))
        kept = {}
        for j, name in enumerate(names):
            kept[name] = self._streams[name] if name in self._streams else self._begun(name, begin)
            even, bell = kept[name]
            uniform[j], normal[j] = even.random(size), bell.standard_normal((size, self._m))
        self._streams = kept
        return uniform, normal

    def _begun(self, name: str, begin: int) -> tuple[np.random.Generator, np.random.Generator]:
        """Return an object's two streams where scan `begin` finds them."""
        even, bell = self._stream(name), self._stream(name)
        _skip(even, begin)
        _skip(bell, self._count)
        for done in range(0, begin, BLOCK):
            bell.standard_normal((min(BLOCK, begin - done), self._m))
        return even, bell


def _skip(stream: np.random.Generator, uniform: int) -> None:
    """Leave out so many uniform numbers, of which each is one step of the generator."""
    bits = stream.bit_generator
    assert isinstance(bits, np.random.PCG64)
    bits.advance(uniform)
