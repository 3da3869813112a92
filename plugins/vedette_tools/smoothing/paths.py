"""Reports of many objects side by side: one step takes the next report of each, whatever its time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property

import numpy as np
from attrs import frozen

from vedette.space import Array, Indices, Mask


@frozen(eq=False)
class Paths:
    """Reports in the order of their pieces, then of time; a piece is an unbroken stretch of one object.

    starts: (p + 1,) where each piece begins, and where the last ends; times (n,) in s; spots (n, d) in m along d axes;
    velocities (n, d) in m/s, NaN where none is reported; told (n,): whether a row reports a position, or only asks for one.
    """

    starts: Indices
    times: Array
    spots: Array
    velocities: Array
    told: Mask

    def __len__(self) -> int:
        return len(self.times)

    @cached_property
    def lengths(self) -> Indices:
        """The number of rows of each piece."""
        return np.diff(self.starts)

    @cached_property
    def piece(self) -> Indices:
        """The piece of each row."""
        return np.repeat(np.arange(len(self.lengths)), self.lengths)

    @cached_property
    def waits(self) -> Array:
        """The time since the row before, in s; 0 at the first row of a piece."""
        dt = np.diff(self.times, prepend=self.times[:1])
        dt[self.starts[:-1][self.lengths > 0]] = 0.0
        return dt

    def only(self, rows: Indices, starts: Indices) -> Paths:
        """Return some rows, in pieces that begin at `starts` among them."""
        return Paths(starts, self.times[rows], self.spots[rows], self.velocities[rows], self.told[rows])

    def without(self, rows: Mask) -> Paths:
        """Return the paths without the rows that are marked; a piece may become empty."""
        kept = np.flatnonzero(~rows)
        return self.only(kept, np.searchsorted(kept, self.starts))

    def steps(self, *, backwards: bool = False) -> Iterator[tuple[int, Indices]]:
        """Yield how many rows lie before in each piece, and the rows (b,) of all pieces that are so long.

        The longest pieces come first, so that the pieces of one step are the first of those of the step before.
        """
        order = np.argsort(-self.lengths, kind="stable")
        starts, lengths = self.starts[:-1][order], self.lengths[order]
        most = int(lengths[0]) if len(lengths) else 0
        alive = np.searchsorted(-lengths, -np.arange(most), side="left")
        for k in reversed(range(most)) if backwards else range(most):
            yield k, starts[: alive[k]] + k


def windows(paths: Paths, most: int, overlap: int) -> tuple[Paths, Indices, Mask, Indices]:
    """Return the paths with pieces of more than `most` rows cut into several, each with `overlap` rows more on either side.

    Beside them, of which row each is a copy, whether it is one of its window's own, and of which piece each window is.
    """
    if not (paths.lengths > most + overlap).any():
        return paths, np.arange(len(paths)), np.ones(len(paths), dtype=bool), np.arange(len(paths.lengths))
    rows, own, lengths, pieces = [], [], [], []
    for piece, (first, last) in enumerate(zip(paths.starts[:-1].tolist(), paths.starts[1:].tolist(), strict=True)):
        cuts = range(first, last, most) if last - first > most + overlap else [first]
        for cut in cuts:
            end = min(cut + most, last) if len(cuts) > 1 else last
            low, high = max(cut - overlap, first), min(end + overlap, last)
            among = np.arange(low, high)
            rows.append(among)
            own.append((among >= cut) & (among < end))
            lengths.append(high - low)
            pieces.append(piece)
    every = np.concatenate(rows)
    starts = np.concatenate([[0], np.cumsum(lengths)]).astype(int)
    return paths.only(every, starts), every, np.concatenate(own), np.array(pieces)


def edges_of(codes: Indices) -> Indices:
    """Return where runs of equal codes begin, and where the last ends."""
    return np.concatenate([[0], np.flatnonzero(np.diff(codes)) + 1, [len(codes)]]).astype(int)
