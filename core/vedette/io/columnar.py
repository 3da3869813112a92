"""Tables in columns, Parquet files and data frames of pandas, read as the cells of a CSV file are."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from datetime import date, time
from pathlib import Path
from typing import Any

from attrs import frozen

from vedette.errors import InputError
from vedette.io.opening import check_regular

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


TablePath = Path | FrameTable
"""Where a table is: a file, or a data frame."""


def pyarrow() -> tuple[Any, Any]:
    """Return pyarrow and its module for Parquet files; InputError without them."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as parquet
    except ImportError:
        raise InputError("Parquet files need pyarrow: pip install 'vedette[data]'") from None
    return pa, parquet


def is_columnar(path: TablePath) -> bool:
    """Return whether a table is a Parquet file or a data frame, not text."""
    return isinstance(path, FrameTable) or path.suffix.lower() == SUFFIX


def header_and_rows(path: TablePath, wanted: Iterable[str]) -> tuple[list[str], Iterator[list[str]]]:
    """Return all titles, and the cells of each row under the `wanted` ones that exist, in the order of the titles.

    An empty cell is "". InputError if the file cannot be read.
    """
    if isinstance(path, FrameTable):
        return _of_frame(path.frame, set(wanted))
    return _of_parquet(path, set(wanted))


def _of_frame(frame: Any, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
    frame = frame if all(name is None for name in frame.index.names) else frame.reset_index()
    titles = [str(title) for title in frame.columns]
    columns = [frame.iloc[:, i].tolist() for i, title in enumerate(titles) if title in wanted]
    return titles, (list(map(cell, row)) for row in zip(*columns, strict=True))


def _of_parquet(path: Path, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
    pa, parquet = pyarrow()
    check_regular(path)
    try:
        file = parquet.ParquetFile(path)
        titles = list(file.schema_arrow.names)
        if file.metadata.num_rows > MOST_ROWS:
            raise InputError(f"{path}: has {file.metadata.num_rows:,} rows, and at most {MOST_ROWS:,} are read")
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
    names = [title for title in titles if title in wanted]

    def given() -> Iterator[list[str]]:
        try:
            for batch in file.iter_batches(BATCH, columns=names):
                columns = [_values(batch.column(name)) for name in names]
                yield from (list(map(cell, row)) for row in zip(*columns, strict=True))
        except (OSError, pa.ArrowException) as error:
            raise InputError(f"{path}: cannot be read as Parquet: {error}") from None

    return titles, given()


def _values(column: Any) -> Sequence[Any]:
    """Return a column's values; dates to the microsecond, as Python holds no finer ones."""
    import pyarrow as pa

    if pa.types.is_timestamp(column.type):
        column = column.cast(pa.timestamp("us", column.type.tz), safe=False)
    elif pa.types.is_time64(column.type):
        column = column.cast(pa.time64("us"), safe=False)
    values: Sequence[Any] = column.to_pylist()
    return values


def cell(value: Any) -> str:
    """Return a value as a CSV file shows it: a number by its fewest digits, a date by ISO 8601, nothing as ""."""
    if value is None or value != value:  # NaN and NaT
        return ""
    if isinstance(value, float):
        return repr(float(value))
    if isinstance(value, date | time):
        return value.isoformat()
    return str(value).strip()
