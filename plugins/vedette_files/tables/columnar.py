"""Tables in columns or records, not text: Parquet files, data frames, JSON, GPX; read as the cells of a CSV file are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from datetime import date, time, timedelta
from pathlib import Path
from typing import Any, TypeAlias

from attrs import frozen

from vedette.errors import InputError
from vedette_files.apart import ApartTable
from vedette_files.input_files import check_regular
from vedette_files.libraries import needed
from vedette_files.tables.records import SUFFIXES, header_and_records

SUFFIX, PARQUET = ".parquet", "Parquet"
"""How the name of such a file ends, and what a recording's note `table` says of one."""

MOST_ROWS = 50_000_000
"""Rows of a Parquet file: some kilobytes may claim any number of them."""

BATCH = 65_536
"""Rows that are in memory at a time."""


@frozen(eq=False)
class FrameTable:
    """A data frame of pandas in the place of a file; its index counts as columns if it has names."""

    frame: Any
    name: str = "data frame"

    def __str__(self) -> str:
        return self.name


TablePath: TypeAlias = Path | FrameTable | ApartTable
"""Where a table is: a file, a data frame, or a file that another process decodes."""


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and its module for Parquet files; InputError without them."""
    told = "tables in columns, as of Parquet, need pyarrow"
    return needed("pyarrow", told, "data"), needed("pyarrow.parquet", told, "data")


def frame_of(data: Any) -> Any:
    """Return a data frame of pandas as it is; columns by name, rows by name or a structured array as one.

    InputError for anything else: an array without names does not say what its columns are.
    """
    if hasattr(data, "columns") and hasattr(data, "iloc"):
        return data
    named = isinstance(data, Mapping) or getattr(getattr(data, "dtype", None), "names", None)
    if named or (isinstance(data, list | tuple) and data and all(isinstance(row, Mapping) for row in data)):
        pd = needed("pandas", "tables in memory need pandas", "data")
        try:
            return pd.DataFrame(data)
        except ValueError as error:
            raise InputError(f"the data are no table: {error}") from None
    wanted = "a file's path, a data frame of pandas, or columns by name as { 't': [...], 'x': [...], 'y': [...] }"
    raise InputError(f"the data must be {wanted}, got {type(data).__name__}")


def is_columnar(path: TablePath) -> bool:
    """Return whether a table is a data frame, a Parquet file or one of records, not rows of text."""
    return isinstance(path, FrameTable | ApartTable) or path.suffix.lower() in (SUFFIX, *SUFFIXES)


def header_and_rows(path: TablePath, wanted: Iterable[str]) -> tuple[list[str], Iterator[list[str]]]:
    """Return all titles, and the cells of each row under the `wanted` ones that exist, in the order of the titles.

    An empty cell is "". InputError if the file cannot be read.
    """
    if isinstance(path, FrameTable):
        return _of_frame(path.frame, set(wanted))
    if isinstance(path, ApartTable):
        return path.cells(set(wanted))
    if path.suffix.lower() in SUFFIXES:
        return _of_records(path, set(wanted))
    return parquet_cells(path, set(wanted))


def _of_frame(frame: Any, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
    frame = frame if all(name is None for name in frame.index.names) else frame.reset_index()
    titles = [str(title) for title in frame.columns]
    columns = [frame.iloc[:, i].tolist() for i, title in enumerate(titles) if title in wanted]
    return titles, (list(map(cell, row)) for row in zip(*columns, strict=True))


def _of_records(path: Path, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
    titles, records = header_and_records(path)
    names = [title for title in titles if title in wanted]
    return titles, ([cell(record.get(name)) for name in names] for record in records)


def parquet_cells(path: Path, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
    """Return all titles of a Parquet file, and the cells of each row under the `wanted` ones; x in pos has pos.x."""
    pa, parquet = pyarrow()
    check_regular(path)
    try:
        file = parquet.ParquetFile(path)
        titles = list(_flat(file.schema_arrow.empty_table()).column_names)
        if file.metadata.num_rows > MOST_ROWS:
            raise InputError(f"{path}: has {file.metadata.num_rows:,} rows, and at most {MOST_ROWS:,} are read")
    except (OSError, UnicodeDecodeError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
    names = [title for title in titles if title in wanted]

    def given() -> Iterator[list[str]]:
        try:
            for batch in file.iter_batches(BATCH, columns=list(dict.fromkeys(names))):
                columns = [_values(column) for column in _flat(pa.Table.from_batches([batch])).columns]
                yield from (list(map(cell, row)) for row in zip(*columns, strict=True))
        except (OSError, UnicodeDecodeError, pa.ArrowException) as error:
            raise InputError(f"{path}: cannot be read as Parquet: {error}") from None

    return titles, given()


def _flat(table: Any) -> Any:
    """Return a table whose columns of records are columns of what these hold."""
    flat = table.flatten()
    return table if flat.column_names == table.column_names else _flat(flat)


def _values(column: Any) -> Sequence[Any]:
    """Return a column's values; dates to the microsecond, as Python holds no finer ones."""
    import pyarrow as pa

    if pa.types.is_timestamp(column.type):
        column = column.cast(pa.timestamp("us", column.type.tz), safe=False)
    elif pa.types.is_time64(column.type):
        column = column.cast(pa.time64("us"), safe=False)
    return column.to_pylist()


def cell(value: Any) -> str:
    """Return a value as a CSV file shows it: a number by its fewest digits, a date by ISO 8601, nothing as "".

    A duration is a number of s.
    """
    if type(value) is float:
        return repr(value) if value == value else ""
    if value is None or isinstance(value, float | date | time):
        if value is None or value != value:  # NaN and NaT
            return ""
        return repr(float(value)) if isinstance(value, float) else value.isoformat()
    if isinstance(value, timedelta):
        return repr(value.total_seconds())
    text = str(value).strip()
    return "" if text in ("<NA>", "NaN") and not isinstance(value, str) else text
