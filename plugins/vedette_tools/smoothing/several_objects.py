"""Whether rows that are taken for one object's are of several: these are smoothed to one path that nothing flew."""

from __future__ import annotations

import numpy as np

from vedette.errors import InputError
from vedette.space import Array, Indices
from vedette_tools.smoothing.cleaning import off_line
from vedette_tools.smoothing.paths import Paths
from vedette_tools.smoothing.smoother import Smooth
from vedette_tools.smoothing.two_chains import two_chains

EARLIER = 2 ** np.arange(1, 8)
"""Among so many rows before a row, one is looked for that lies near it."""

NEARER = 30.0
"""So many times, squared, the nearest of k earlier rows lies nearer than the last beyond what k white errors make of it:
one error in thirty does.
"""

ASIDE = 0.4
"""So many steps from the row before, a row lies off the line between its neighbours: one that comes by again does not."""

PART = 0.3
"""By so many jumps rows are of several objects. Of two whose reports take turns at random it is .4, .69 to 1 of 3 to
80 drawn ones; of one object at most .1 recorded (83 ships, 26 aircraft), and .21 with 30 % gross positions.
"""

OBJECTS, ROWS, LEAST = 20, 300, 20
"""So many objects are looked at, and so many rows of all of them; of each one that has at least so many."""

FEW, CHUNK = 16, 200
"""Of each of all objects so many rows are looked at first, more where half of PART jump; so many objects at once."""

TWO, ENOUGH = 1.2, 40
"""So small is the mean fourth power of the distance from a path over the square of the mean square where rows lie at two
places, 1 without errors; it is 2 of Gaussian ones, 1.4 of digits. Of so many rows one object in 1e5 has it by chance.
"""


def check_apart(paths: Paths, objects: Indices, name: str, roundings: Array, data: str, by: str) -> None:
    """Raise InputError if rows of one object, or of most objects that the column `name` tells apart, are of several.

    objects (p,): whose each piece is, in order; roundings (o,): the deviation of positions in m by their digits; data: what
    was read; by: how a column that names objects is stated.
    """
    told, ends, counts = _told(paths, objects)
    many = np.flatnonzero(counts >= LEAST)[:OBJECTS]
    parts = _jumping(paths, told, ends[many] - counts[many], counts[many], ROWS // max(len(many), 1), roundings[many])
    if len(parts) and float(np.median(parts)) > PART:
        of = f"one {name}" if name else "what is taken for one object"
        far = f"{float(np.median(parts)):.0%} of the rows of {of} lie far from the row before, and near an earlier one"
        cure = f"say {by} if a column tells them apart; if none does, track them: `vedette new config`"
        raise InputError(f"{data}: {far}: these are several objects; {cure}")


def mixed(paths: Paths, objects: Indices, smooth: Smooth, roundings: Array) -> Indices:
    """Return the objects whose rows seem to be of several: they jump, lie in two places beside the path, or on two paths."""
    told, ends, counts = _told(paths, objects)
    many = np.flatnonzero((counts >= LEAST) & (len(counts) > 1))  # of one `check_apart` has looked at more rows
    first = ends[many] - counts[many]
    parts = _jumping(paths, told, first, counts[many], FEW, roundings[many])
    doubted = np.flatnonzero(parts > PART / 2)
    parts[doubted] = _jumping(paths, told, first[doubted], counts[many][doubted], ROWS, roundings[many][doubted])
    whose = np.repeat(np.arange(len(counts)), counts)
    squared = np.nan_to_num(((paths.spots - smooth.estimates.spots)[told] ** 2).sum(axis=-1))
    second, fourth = (np.bincount(whose, squared**power, len(counts)) / np.maximum(counts, 1) for power in (1, 2))
    two = (fourth < TWO * second**2) & (second > 8.0 * roundings[: len(counts)] ** 2) & (counts >= ENOUGH)
    return np.union1d(np.union1d(many[parts > PART], np.flatnonzero(two)), two_chains(paths, smooth, roundings))


def _told(paths: Paths, objects: Indices) -> tuple[Indices, Indices, Indices]:
    """Return the rows that report a position, and where those of each object end among them, and how many it has."""
    told = np.flatnonzero(paths.told)
    counts = np.bincount(np.repeat(objects, paths.lengths)[told], minlength=1)
    return told, np.cumsum(counts), counts


def _jumping(paths: Paths, told: Indices, first: Indices, counts: Indices, most: int, roundings: Array) -> Array:
    """Return of objects (o,), whose rows begin at `first` among those told, by `most` of them, which part lies far from the
    row before and off the line to the next, and near an earlier one.
    """
    found = [np.zeros(0)]
    for low in range(0, len(first), CHUNK):
        begin, count = first[low : low + CHUNK, None], counts[low : low + CHUNK, None]
        looked = begin + 1 + (np.linspace(0, 1, min(most, int(count.max()) - 2)) * (count - 3)).astype(int)
        reach = min(int(EARLIER[-1]), int(count.max()))
        before = looked[..., None] - np.arange(1, reach + 1)
        earlier = told[np.maximum(before, 0)]
        apart = sum((axis[told[looked]][..., None] - axis[earlier]) ** 2 for axis in paths.spots.T)
        nearest = np.minimum.accumulate(np.where(before < begin[..., None], np.inf, apart), axis=-1)
        nearest = nearest[..., np.minimum(EARLIER, reach) - 1]
        step, least = apart[..., :1], 4 * roundings[low : low + CHUNK, None, None] ** 2
        aside = off_line(paths, told[looked - 1], told[looked], told[looked + 1])[..., None] > ASIDE * np.sqrt(step)
        found.append(np.mean(aside & (step > NEARER * EARLIER * (nearest + least)), axis=1).max(axis=-1))
    return np.concatenate(found)
