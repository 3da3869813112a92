"""The column that seems to tell objects apart by what it does, whatever its title."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from itertools import pairwise

import numpy as np

from vedette.space import Array
from vedette_files.tables.numbers import degrees, is_number

ROWS, FAR = 8, 5.0
"""Of each name there are so many rows, usually; from one to the next of a name it is so many times less far than from row to
row. By hand: a boat's that reports every minute, of six polled in turn 2 km apart, are 60 times nearer.
"""

CHANGES = 0.5
"""In such a part of the rows, at least, another name stands than in the row before: else these are stretches of one path."""


def told_apart(columns: Mapping[str, Sequence[str]], taken: Collection[str], places: Sequence[Sequence[str]]) -> str:
    """Return the column of few values of which each makes a path where all rows together jump; "" without one.

    taken: what is read besides; places: the columns of positions.

    >>> x = ["0", "900", "1", "901", "2", "902"] * 3
    >>> told_apart({"cow": ["a", "b"] * 9, "n": [*map(str, range(18))], "x": x}, ["x"], [x])
    'cow'
    """
    if not places or not all(cell for column in places for cell in column):
        return ""
    try:
        spots = np.array([[float(cell) if is_number(cell) else degrees(cell) for cell in column] for column in places]).T
    except ValueError:
        return ""
    steps = _step(spots)
    found: dict[str, float] = {}
    for title, cells in columns.items():
        count = len({*cells})
        changes = sum(before != after for before, after in pairwise(cells))
        if title in taken or not all(cells) or not 1 < count <= len(cells) / ROWS or changes < CHANGES * len(cells):
            continue
        names = np.unique(np.array(cells), return_inverse=True)[1]
        order = np.argsort(names, kind="stable")
        own = np.linalg.norm(np.diff(spots[order], axis=0), axis=-1)[np.diff(names[order]) == 0]
        if (near := float(np.quantile(own, 0.75))) < steps / FAR:
            found[title] = near
    return min(found, key=lambda title: found[title], default="")


def _step(spots: Array) -> float:
    """Return how far it is from row to row, but for a quarter of them."""
    return float(np.quantile(np.linalg.norm(np.diff(spots, axis=0), axis=-1), 0.25)) if len(spots) > 1 else 0.0
