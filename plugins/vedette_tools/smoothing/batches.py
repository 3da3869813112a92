"""The rows of files, as batches of Arrow: CSV and Parquet files of any length, tables of records."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from vedette.errors import InputError
from vedette_files.input_files import encoding, lines
from vedette_files.libraries import needed
from vedette_files.tables.columnar import SUFFIX, header_and_rows, is_columnar, pyarrow
from vedette_files.tables.rows import header_line
from vedette_tools.drafting.first_rows import dialect_of
from vedette_tools.smoothing.columns import check_titles
from vedette_tools.smoothing.folders import folders

BATCH = 131_072
"""Rows of a Parquet file that are read at once."""


def tables(given: Sequence[Path]) -> list[Path]:
    """Return the files that paths name, a folder all Parquet files in it; InputError if there is none."""
    files = []
    for path in given:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder")
        inside = sorted(path.glob(f"**/*{SUFFIX}")) if path.is_dir() else [path]
        if not inside:
            raise InputError(f"{path}: the folder holds no {SUFFIX} file")
        files += inside
    if len({path.suffix.lower() if is_columnar(path) else "" for path in files}) > 1:
        raise InputError(
            f"{files[0]}: files of several kinds cannot be smoothed together: smooth those of each kind by themselves"
        )
    return files


def titles_of(path: Path) -> list[str]:
    """Return the titles of a file's columns, and those of the folders that it is in, as `mmsi=235000000`."""
    if is_columnar(path):
        titles = header_and_rows(path, ())[0]
    else:
        titles = [title.strip() for title in dialect_of(path).cells(header_line(lines(path))[1]) or []]
    check_titles(titles, str(path))
    return [*titles, *(title for title in folders(path) if title not in titles)]


def batches(path: Path, titles: Sequence[str], lost: list[int]) -> Iterator[Any]:
    """Yield a file's rows in the order of the titles, those of text with each cell as it stands; count those that have too
    many cells or too few.

    InputError if the file has other columns.
    """
    pa, _ = pyarrow()
    own = titles_of(path)
    if set(own) != set(titles):
        more, less = ([repr(title) for title in one if title not in other] for one, other in ((own, titles), (titles, own)))
        said = [f"{words} {', '.join(names)}" for words, names in (("has no column", less), ("has a column", more)) if names]
        raise InputError(f"{path}: {' and '.join(said)}, unlike the first file: smooth such files by themselves")
    alike = {title: value for title, value in folders(path).items() if title in titles}
    try:
        for batch in _rows(path, [title for title in own if title not in alike], lost):
            for title, value in alike.items():
                batch = batch.append_column(title, pa.array([value] * batch.num_rows, pa.string()))
            yield batch.select(list(titles))
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise InputError(_unread(path) or f"{path}: cannot be read: {error}") from None


def _rows(path: Path, titles: Sequence[str], lost: list[int]) -> Iterator[Any]:
    pa, parquet = pyarrow()
    if path.suffix.lower() == SUFFIX:
        # Buffered by itself, a whole row group would be in memory, however large its writer made it.
        yield from parquet.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20).iter_batches(BATCH)
        return
    if is_columnar(path):
        cells = zip(*header_and_rows(path, titles)[1], strict=True)
        yield pa.RecordBatch.from_pydict(
            {title: [cell or None for cell in own] for title, own in zip(titles, cells, strict=True)}
        )
        return
    csv = needed("pyarrow.csv", "large tables need pyarrow", "data")
    numbers, _, _ = header_line(lines(path))
    _check_text(path)

    def left_out(row: Any) -> str:
        lost[0] += 1
        return "skip"

    reader = csv.open_csv(
        path,
        read_options=csv.ReadOptions(skip_rows=numbers[-1], column_names=titles, encoding=encoding(path)),
        parse_options=csv.ParseOptions(delimiter=dialect_of(path).delimiter, invalid_row_handler=left_out),
        convert_options=csv.ConvertOptions(
            column_types=dict.fromkeys(titles, pa.string()), strings_can_be_null=True, null_values=[""]
        ),
    )
    yield from reader


def _unread(path: Path) -> str:
    """Return the place of the first line of a text that is not as it is encoded; "" if there is none."""
    if is_columnar(path):
        return ""
    number = next((number for number, line in lines(path) if "\ufffd" in line), None)
    return "" if number is None else f"{path}:{number}: is not in UTF-8: save the table in UTF-8"


def _check_text(path: Path) -> None:
    """Raise InputError at a line with a quotation mark that is not closed: pyarrow takes what follows for a part of it."""
    with path.open("rb") as file:
        if not any(b'"' in block for block in iter(partial(file.read, 1 << 20), b"")):
            return
    for number, line in lines(path):
        if line.count('"') % 2:
            told = "a quotation mark is not closed in its line: close it, delete it, or write each row in one line"
            raise InputError(f"{path}:{number}: {told}")


def cast(path: Path, batch: Any, schema: Any) -> Any:
    """Return a batch in the types of the first file's columns; InputError if that loses something."""
    pa, _ = pyarrow()
    try:
        return pa.Table.from_batches([batch]).cast(schema).to_batches()[0]
    except pa.ArrowException as error:
        raise InputError(f"{path}: its columns are of other types than the first file's: {error}") from None


def rows_in(path: Path) -> int:
    """Return how many rows a file has, about."""
    if path.suffix.lower() == SUFFIX:
        pa, parquet = pyarrow()
        try:
            return int(parquet.read_metadata(path).num_rows)
        except pa.ArrowException as error:
            raise InputError(f"{path}: cannot be read as Parquet: {error}") from None
    with path.open("rb") as file:
        start = file.read(1 << 16)
    return int(path.stat().st_size / max(len(start) / max(start.count(b"\n"), 1), 1.0))
