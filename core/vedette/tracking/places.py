"""Where the members of groups come to lie, each in its group's row of a table."""

from __future__ import annotations

import numpy as np

from vedette.space import Indices


def places(groups: Indices, count: int) -> Indices:
    """Return each entry's place among those of its group, in their order; groups (p,) are numbers below `count`."""
    order = np.argsort(groups, kind="stable")
    number = np.bincount(groups, minlength=count)
    found = np.empty_like(order)
    found[order] = np.arange(len(groups)) - np.repeat(np.cumsum(number) - number, number)
    return found
