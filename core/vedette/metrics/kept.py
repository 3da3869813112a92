"""Arrays of all scans, kept if they fit into memory, else made anew each time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import final, overload

from attrs import frozen

from vedette.space import Array

MOST_KEPT = 20_000_000
"""Numbers in all of them beyond which they are not kept: 160 MB."""


@final
@frozen(eq=False)
class Remade(Sequence[Array]):
    """A sequence whose items are made on demand, each time anew: the i-th by `make(indices[i])`."""

    indices: range
    make: Callable[[int], Array]

    def __len__(self) -> int:
        return len(self.indices)

    @overload
    def __getitem__(self, index: int) -> Array: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Array]: ...
    def __getitem__(self, index: int | slice) -> Array | Sequence[Array]:
        return Remade(self.indices[index], self.make) if isinstance(index, slice) else self.make(self.indices[index])


def kept(count: int, make: Callable[[int], Array], numbers: int) -> Sequence[Array]:
    """Return `count` arrays, `numbers` in all of them together: a tuple, or beyond MOST_KEPT made anew at each use."""
    every = Remade(range(count), make)
    return tuple(every) if numbers <= MOST_KEPT else every
