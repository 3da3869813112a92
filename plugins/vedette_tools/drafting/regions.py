"""Places that are too far apart for one plane: origins for several, and how to run a config for each."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from shlex import quote

import numpy as np

from vedette.space import Array, Indices
from vedette.types import Recording
from vedette_files import Origin
from vedette_files.readers import BEYOND_PLANE
from vedette_files.tables.numbers import degrees
from vedette_files.tables.rows import rows
from vedette_tools.drafting.table import Table

MOST, STEP = 12, 5.0
"""So many regions are found, at most, and their origins stand so many deg apart, at least as far as one plane reaches. By
hand: storms of all oceans take eleven.
"""
FEW = 0.01
"""What such a part of the rows or less holds is no region: zeros, or codes for what is not known. By hand."""

Region = tuple[Origin, int]
"""An origin, and how many rows no region before it reaches."""


def beyond(recording: Recording) -> int:
    """Return how many rows were refused as they lie beyond the plane."""
    return sum(problem.rows for problem in recording.refused if problem.kind == BEYOND_PLANE)


def regions(table: Table) -> list[Region]:
    """Return origins whose planes reach all rows of a table, that of most rows first."""
    left, found = _places(table), list[Region]()
    few = FEW * len(left)
    origins = [Origin(*map(float, place)) for place in np.unique(np.round(left / STEP), axis=0) * STEP]
    counts = _reached(origins, left)
    while len(origins) and len(found) < MOST and counts.max() > few:
        best = int(np.argmax(counts))
        reached = origins[best].reaches(*left.T)
        own, left = left[reached], left[~reached]
        middle = Origin.among(own)
        found.append((middle if middle.reaches(*own.T).all() else origins[best], len(own)))
        counts -= _reached(origins, own)
    return found


def _reached(origins: Sequence[Origin], places: Array) -> Indices:
    """Return how many places (k, 2) the plane around each origin reaches."""
    return np.array([np.count_nonzero(origin.reaches(*places.T)) for origin in origins])


def told_of(others: Sequence[Region], left_out: int, total: int) -> str:
    """Say how many rows a plane does not reach, and where others would lie."""
    origins = "; ".join(f"{origin.latitude:g}, {origin.longitude:g}" for origin, _ in others)
    told = f"{left_out:,} of {total:,} rows are left out: one plane does not reach them"
    return f"{told}; run the config for other origins, too: {origins}; what goes from one to another has a track in each"


def commands(others: Sequence[Region], config: Path) -> Iterator[str]:
    """Yield what to type to run a config for other regions than its own."""
    for i, (origin, _) in enumerate(others, 2):
        where = f"--set source.origin.latitude={origin.latitude:g} --set source.origin.longitude={origin.longitude:g}"
        yield f"vedette run {quote(str(config))} --out {quote(f'{config.stem}-{i}')} {where}"


def _places(table: Table) -> Array:
    """Return the latitudes and longitudes (k, 2) of a table in deg, longitudes within 180."""
    wanted = {axis: table.measured[axis] for axis in ("latitude", "longitude")}
    source = table.frame_table or Path(table.path)
    found = []
    for row in rows(source, wanted, "source.detections", table.dialect, []):
        try:
            found.append([degrees(row.cells[axis]) for axis in wanted])
        except ValueError:
            continue
    places: Array = np.array(found, dtype=float).reshape(-1, 2)
    places = places[np.all(np.isfinite(places), axis=-1) & (np.abs(places[:, 0]) <= 90.0)]
    places[:, 1] = (places[:, 1] + 180.0) % 360.0 - 180.0
    return places
