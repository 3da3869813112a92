"""Tracks as a table: a row for each track and scan, by column."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, Space, Track
from vedette_files.georeference import PLAIN, Terms
from vedette_files.tables.columnar import pyarrow
from vedette_files.tracks.rows import EXTRA, mode_count
from vedette_files.writing import whole_bytes


def columns_of(space: Space, modes: int, terms: Terms = PLAIN, extra: Sequence[str] = ()) -> list[str]:
    """Return the titles of a table of tracks over `space` with so many `modes` and `extra` columns of `EXTRA`."""
    names = space.names
    titles = ["track", "time", *names, *(f"sd_{name}" for name in names)]
    titles += [f"cov_{names[i]}_{names[j]}" for i, j in combinations_with_replacement(range(len(space)), 2)]
    titles += ["confirmed", "existence", "hit", "nis", *(f"mode_{i + 1}" for i in range(modes))]
    return [*titles, *extra, *terms.columns(space)]


def numbers_of(track: Track) -> tuple[Array, Array]:
    """Return a track's numbers before (s, p) and after (s, q) `confirmed`, without its id and its columns in other terms."""
    pairs = list(combinations_with_replacement(range(len(track.space)), 2))
    deviations = np.sqrt(np.maximum(np.diagonal(track.cov, axis1=-2, axis2=-1), 0.0))
    triangle = track.cov[:, [i for i, _ in pairs], [j for _, j in pairs]]
    judged = np.column_stack([track.existence, track.hit, track.nis])
    judged = judged if track.mode_prob is None else np.hstack([judged, track.mode_prob])
    extra = [values for name in EXTRA if (values := getattr(track, name)) is not None]
    judged = np.column_stack([judged, *extra]) if extra else judged
    return np.column_stack([track.times, track.mean, deviations, triangle]), judged


def table_of(tracks: Sequence[Track], space: Space, terms: Terms = PLAIN) -> dict[str, Any]:
    """Return the table of tracks, title to values (rows,): those of `tracks.csv`."""
    parts = []
    for track in tracks:
        before, after = numbers_of(track)
        columns = [np.full(len(track.times), track.id), *before.T, track.confirmed, *after.T]
        parts.append([*columns, *(np.asarray(values) for values in terms.values(track).values())])
    extra = [name for name in EXTRA if any(getattr(track, name) is not None for track in tracks)]
    titles = columns_of(space, mode_count(tracks, space), terms, extra)
    if not parts:
        return {title: np.zeros(0) for title in titles}
    return {title: np.concatenate(column) for title, column in zip(titles, zip(*parts, strict=True), strict=True)}


def write_tracks_parquet(
    path: Path, tracks: Sequence[Track], space: Space, terms: Terms = PLAIN, notes: Mapping[str, str] | None = None
) -> None:
    """Write the table of tracks as a Parquet file, with notes; a number that is not finite is null. Needs pyarrow."""
    _, parquet = pyarrow()
    table = arrow_table(table_of(tracks, space, terms))
    with whole_bytes(path) as file:
        parquet.write_table(table if notes is None else table.replace_schema_metadata(notes), file)


def arrow_table(columns: Mapping[str, Any]) -> Any:
    """Return columns as a table of pyarrow, null where a number is not finite."""
    pa, _ = pyarrow()
    return pa.table(
        {
            title: pa.array(values, mask=~np.isfinite(values) if values.dtype.kind == "f" else None)
            for title, values in columns.items()
        }
    )
