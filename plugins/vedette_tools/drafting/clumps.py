"""Whether objects give several returns a scan: these lie near each other, and apart from those of the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.space import Array

WIDE, BETWEEN, WITHIN = 3.0, 0.1, 0.15
"""Returns lie in clumps where such a part of them are joined by steps up to some length, and hardly more by steps up to so
many times that: such a part of those.
"""

AGAIN, SMALL = 0.2, 0.2
"""Then such a part more are joined by longer steps, or all by such as are small: that length, so many times, against the
spread of all returns. All by hand, on drawn cars, ships, walkers and clutter.
"""

LOOKS = 300
"""So many scans tell it."""

MOST = 500
"""Of a scan of more returns so many are looked at: those nearest to one of them."""


def clumped(spots: Sequence[Array]) -> float | None:
    """Return the distance in m, within which returns of a scan at `spots` (k, 2) are of one object; None: they are apart."""
    from scipy.cluster.hierarchy import linkage

    every = [_part(places) for places in spots[:: max(1, len(spots) // LOOKS)] if len(places) > 1]
    steps = np.sort(np.concatenate([linkage(places, "single")[:, 2] for places in every])) if every else np.zeros(0)
    returns = sum(map(len, every))
    below = np.arange(int(WITHIN * returns), len(steps))
    if not len(below):
        return None
    beyond = (np.searchsorted(steps, WIDE * steps[below], side="right") - below) / below
    again = np.maximum.accumulate(beyond[::-1])[::-1] > AGAIN
    small = WIDE * steps[below] < SMALL * np.max(np.std(np.concatenate(every), axis=0))
    apart = np.where((steps[below] > 0) & (again | small), beyond, np.inf)
    best = int(np.argmin(apart))
    return float(np.sqrt(WIDE) * steps[below[best]]) if apart[best] < BETWEEN else None


def _part(places: Array) -> Array:
    """Return at most so many of the places (k, n): the nearest to the one in the middle of their order."""
    if len(places) <= MOST:
        return places
    apart = np.linalg.norm(places - places[len(places) // 2], axis=-1)
    return places[np.argpartition(apart, MOST)[:MOST]]
