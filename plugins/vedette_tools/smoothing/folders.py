"""Columns that the names of folders state, as Spark, Dask and DuckDB part a table: `mmsi=235000000/part-0.parquet`."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import unquote

from vedette_files.tables.columnar import TablePath


def folders(path: TablePath) -> dict[str, str]:
    """Return the columns that the names of a file's folders state, all its rows being alike in them."""
    stated = (part.partition("=") for part in path.parts[:-1]) if isinstance(path, Path) else ()
    return {title: unquote(value) for title, equals, value in stated if equals and title}
