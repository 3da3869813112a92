"""Whether a clock was set back while times were written, as in autumn: local times, of which some hours come twice."""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette_files import NAMELESS
from vedette_tools.smoothing.columns import Columns

HOUR, ROWS, AHEAD = 3600.0, 20, 5.0
"""Clocks are set back by so many s; told of an object with so many rows or more, where time passes by the usual wait, or by
so many, as well.
"""


def set_back(frame: Any, columns: Columns) -> str:
    """Say where times of an object, whose rows stand in their order, go back once by an hour; "" if none do."""
    times = columns.times(frame)
    names = np.array([str(name) for name in frame[columns.name]] if columns.name else ["one"] * len(frame), dtype=str)
    good = np.flatnonzero(np.isfinite(times) & ~np.isin(np.char.lower(names), NAMELESS))
    order = good[np.argsort(names[good], kind="stable")]
    edges = np.flatnonzero(np.concatenate([[True], names[order][1:] != names[order][:-1], [True]]))
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        rows = order[first:last]
        waits = np.diff(times[rows])
        back = np.flatnonzero(waits < 0)
        if len(rows) < ROWS or len(back) != 1:
            continue
        at = int(back[0])
        if -HOUR <= waits[at] <= AHEAD * np.median(waits) - HOUR:
            before, after = (columns.time_cells(frame).iloc[row] for row in rows[at : at + 2])
            whose = f"times of {str(names[rows[at]])!r}" if columns.name else "times"
            told = f"{whose} go back by 1 h, from {before} to the next row's {after}, as where a clock was set back"
            return f"{told}: the hour that comes twice is taken for one; write times in UTC, or with their offset, as +01:00"
    return ""
