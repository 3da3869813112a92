"""Tracks written while a run goes, piece by piece, as a map and as a table: constant memory, however long it is."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from vedette import Space, Track
from vedette_files.georeference import Terms, geometry, points_of, properties_of
from vedette_files.tables.columnar import pyarrow
from vedette_files.tracks.table import arrow_table, table_of
from vedette_files.writing import whole_bytes, whole_file

Write = Callable[[Sequence[Track]], None]
"""Takes the next pieces of all tracks that go on, and of those that have ended."""


@contextmanager
def geojson_pieces(path: Path, terms: Terms) -> Iterator[Write]:
    """Write a map of the tracks, a line for each piece; the next piece of a track begins where the last one ended.

    Otherwise as `write_geojson`. The file has its name once all is written.
    """
    last: dict[int, tuple[list[float], Any]] = {}
    with whole_file(path) as file:
        file.write('{"type": "FeatureCollection", "features": [\n')
        begun = False

        def write(tracks: Sequence[Track]) -> None:
            nonlocal begun
            told = [(track, *points_of(track, terms, confirmed=track.id in last)) for track in tracks if len(track.times)]
            before = dict(last)
            last.clear()
            for track, line, times in told:
                number = track.id
                known = [before[number]] if number in before else []
                points, at = [point for point, _ in known] + line, [time for _, time in known] + times
                if line:
                    feature = {"type": "Feature", "geometry": geometry(points), "properties": properties_of(track, at)}
                    file.write((",\n" if begun else "") + json.dumps(feature))
                    begun = True
                if points:
                    last[number] = points[-1], at[-1]

        yield write
        file.write("\n]}\n")


@contextmanager
def parquet_pieces(path: Path, space: Space, terms: Terms) -> Iterator[Write]:
    """Write the table of tracks as Parquet, a group of rows for all pieces at a time. Needs pyarrow."""
    _, parquet = pyarrow()
    with whole_bytes(path) as file:
        writer: Any = None

        def write(tracks: Sequence[Track]) -> None:
            nonlocal writer
            told = [track for track in tracks if len(track.times)]
            if told:
                table = arrow_table(table_of(told, space, terms))
                writer = parquet.ParquetWriter(file, table.schema) if writer is None else writer
                writer.write_table(table)

        yield write
        if writer is None:
            parquet.write_table(arrow_table(table_of([], space, terms)), file)
        else:
            writer.close()
