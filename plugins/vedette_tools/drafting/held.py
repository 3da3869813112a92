"""Rows that are not of one measurement each: positions that are repeated, or that share their times."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vedette.space import Array
from vedette_tools.drafting.reading import Reading

CUT, ONWARD = 20, 0.8
"""Times that several rows share, so many or more, are cut where rows lie on one way: from the first row of each to that of
the next they go such a part of the way straight on. By hand: what two targets do in turn goes to and fro."""

HELD_RUNS, HELD_ROWS = 20, 3
"""So many positions, usually in so many rows each, are not measured in each row."""

STEP = 10.0
"""So many times the error that its digits leave is a step that they do not make: three of their last place. By hand."""

SOMEWHERE = 0.3
"""What goes so far, for the way that it makes, is on its way: what is moored jitters. By hand."""


def held(best: Reading) -> str:
    """Say that positions are repeated until the next one comes, as where rows are of another sensor; or return ""."""
    spots = (
        np.concatenate([places for seen in best.seen.values() for places in seen.spots]) if best.lone else np.zeros((0, 2))
    )
    if told := _held_in([spots]):
        return f"nothing fits these data: {told}"
    return ""


def held_on_its_way(best: Reading) -> str:
    """Say that positions of objects that go somewhere are repeated until the next one comes; or return ""."""
    paths = [chain.spots for seen in best.seen.values() for chain in seen.chains]
    ways = [(np.linalg.norm(path[-1] - path[0]), np.linalg.norm(np.diff(path, axis=0), axis=-1).sum()) for path in paths]
    going = [path for path, (far, way) in zip(paths, ways, strict=True) if far > SOMEWHERE * way]
    steps = np.concatenate([np.zeros(0), *(np.linalg.norm(np.diff(path, axis=0), axis=-1) for path in going)])
    by_digits = float(np.max(best.table.floors, initial=0.0)) * STEP
    return _held_in(going) if np.any(steps) and np.median(steps[steps > 0]) > by_digits else ""


def _held_in(paths: Sequence[Array]) -> str:
    runs = np.concatenate(
        [np.zeros(0), *(np.diff(np.flatnonzero(np.any(np.diff(each, axis=0) != 0, axis=-1))) for each in paths)]
    )
    if len(runs) < HELD_RUNS or np.median(runs) < HELD_ROWS:
        return ""
    told = f"each position stands in some {np.median(runs):.0f} rows, until the next one comes"
    return f"{told}; keep the first row of each, with its own time, or name the column of these: --time COLUMN"


def cut(best: Reading) -> str:
    """Say that rows of one object share times, as where these have no fractions of a second; or return ""."""
    for seen in best.seen.values():
        counts = np.array([len(places) for places in seen.spots])
        if len(counts) < CUT or np.median(counts) < 2 or not counts.all():
            continue
        spots = np.concatenate(seen.spots)
        firsts = np.cumsum(counts) - counts
        way = float(np.sum(np.linalg.norm(np.diff(spots[: firsts[-1] + 1], axis=0), axis=-1)))
        if np.sum(np.linalg.norm(np.diff(spots[firsts], axis=0), axis=-1)) > ONWARD * way > 0:
            told = f"some {np.median(counts):.0f} rows share each time and lie on the way of one object"
            return (
                f"nothing fits these data: {told}; name a column with its fractions, --time COLUMN, or keep one row of each"
            )
    return ""
