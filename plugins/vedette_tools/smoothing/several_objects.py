"""Whether rows that are taken for one object's are of several: these are smoothed to one path that nothing flew."""

from __future__ import annotations

import numpy as np

from vedette.errors import InputError
from vedette.space import Indices
from vedette_tools.smoothing.paths import Paths

EARLIER = 2 ** np.arange(1, 8)
"""Among so many rows before a row, one is looked for that lies near it."""

NEARER = 30.0
"""So many times, squared, the nearest of k earlier rows lies nearer than the last beyond what k white errors make of it:
one error in thirty does.
"""

PART = 0.4
"""By so many jumps rows are of several objects. Of two whose reports take turns at random it is a half, .69 to 1 of 2 to
80 drawn ones; of one object at most .1 recorded (83 ships, 26 aircraft), and .21 with 30 % gross positions.
"""

OBJECTS, ROWS, LEAST = 20, 1000, 20
"""So many objects are looked at, and so many rows of all of them; of each one that has at least so many."""


def check_apart(paths: Paths, objects: Indices, name: str, rounding: float, data: str, by: str) -> None:
    """Raise InputError if rows of one object, or of most objects that the column `name` tells apart, are of several.

    objects (p,): whose each piece is, in order; rounding: the deviation of positions in m by their digits; data: what was
    read; by: how a column that names objects is stated.
    """
    whose = np.repeat(objects, paths.lengths)
    told = np.flatnonzero(paths.told)
    counts = np.bincount(whose[told], minlength=1)
    many = np.flatnonzero(counts >= LEAST)[:OBJECTS]
    ends = np.cumsum(counts)
    parts = [jumping(paths, told[ends[one] - counts[one] : ends[one]], ROWS // len(many), rounding) for one in many]
    if len(parts) and float(np.median(parts)) > PART:
        of = f"one {name}" if name else "what is taken for one object"
        far = f"{float(np.median(parts)):.0%} of the rows of {of} lie far from the row before, and near an earlier one"
        cure = f"say {by} if a column tells them apart; if none does, track them: `vedette new config`"
        raise InputError(f"{data}: {far}: these are several objects; {cure}")


def jumping(paths: Paths, rows: Indices, most: int, rounding: float) -> float:
    """Return which part of rows (k,), or of `most` of them, lies far from the row before and near an earlier one."""
    looked = np.unique(np.linspace(1, len(rows) - 1, min(most, len(rows) - 1)).astype(int))
    before = looked[:, None] - np.arange(1, EARLIER[-1] + 1)
    apart = ((paths.spots[rows[looked]][:, None] - paths.spots[rows[np.maximum(before, 0)]]) ** 2).sum(axis=-1)
    nearest = np.minimum.accumulate(np.where(before < 0, np.inf, apart), axis=-1)[:, EARLIER - 1]
    return float(np.mean(apart[:, :1] > NEARER * EARLIER * (nearest + 4 * rounding**2), axis=0).max())
