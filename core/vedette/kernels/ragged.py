"""Rows of unequal length that lie one after another in flat arrays."""

from __future__ import annotations

import numpy as np

from vedette.space import Indices


def counted(count: Indices, first: Indices | int = 0) -> Indices:
    """Return first, first + 1, ... for each row (r,), as many as its count."""
    return np.arange(int(np.sum(count))) + np.repeat(first - (np.cumsum(count) - count), count)


def places(groups: Indices, count: int) -> Indices:
    """Return each entry's place among those of its group, in their order; groups (p,) are numbers below `count`."""
    order = np.argsort(groups, kind="stable")
    place = np.empty_like(order)
    place[order] = counted(np.bincount(groups, minlength=count))
    return place
