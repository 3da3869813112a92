"""Files of named positions, smoothed: rows in the order of time are put together by object on disk first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from functools import partial
from itertools import islice
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from zlib import crc32

import numpy as np
from attrs import astuple, frozen

from vedette.errors import InputError, Problem
from vedette.progress import Progress
from vedette.space import Space
from vedette_files.columnar import SUFFIX, is_columnar, pyarrow
from vedette_files.csv_table import Dialect, header_line, is_number, numbers
from vedette_files.csv_table import rows as rows_of
from vedette_files.csv_times import Times, form_of
from vedette_files.input_files import check_regular, encoding, lines
from vedette_files.libraries import needed
from vedette_files.writing import unfinished
from vedette_tools.drafting.first_rows import dialect_of
from vedette_tools.drafting.table import NO_WISHES
from vedette_tools.drafting.wishes import Wishes
from vedette_tools.smoothing.columns import Columns
from vedette_tools.smoothing.noises import Model
from vedette_tools.smoothing.several_objects import check_apart
from vedette_tools.smoothing.table import GROSS, PIECE, Reports, learned, smoothed_frame

ROWS, MOST_PARTS = 50_000, 200
"""Rows of a part, all of some objects, and how many parts there are at most: as many files are open at once."""

OBJECTS, SAMPLED_PARTS = 100, 8
"""The model is that of so many objects, or of those in so many parts."""

LOOKED_AT = 10_000
"""Among so many rows the first one that cannot be used is looked for."""

BATCH = 131_072
"""Rows of a Parquet file that are read at once."""


@frozen
class Job:
    """What is smoothed and how, for a worker: the folder of the parts, and that of Parquet files if each part becomes one,
    the table's columns, the model, and what is asked.
    """

    folder: Path
    apart: Path | None
    columns: Columns
    model: Model
    every: float | None
    gap: float | None


@frozen
class Told:
    """What was done: rows read, rows left out, those of them of sensors that measure no positions, objects, pieces, gross
    positions, rows written.
    """

    rows: int = 0
    left_out: int = 0
    elsewhere: int = 0
    objects: int = 0
    pieces: int = 0
    gross: int = 0
    written: int = 0

    def __add__(self, other: Told) -> Told:
        return Told(*(mine + others for mine, others in zip(astuple(self), astuple(other), strict=True)))


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
    if len({is_columnar(path) for path in files}) > 1:
        raise InputError(f"{files[0]}: CSV and Parquet files cannot be smoothed together")
    return files


def smooth_files(
    paths: Sequence[Path],
    out: Path,
    by: str | None,
    every: float | None,
    gap: float | None,
    executor: Executor | None,
    progress: Progress,
    wishes: Wishes = NO_WISHES,
) -> tuple[Told, str]:
    """Smooth the positions in files of one kind, as if they were one, and write them to `out`, by object and time.

    A name without a suffix is a new folder, of a Parquet file for each part: workers write these, and nothing is gathered.
    An executor's workers must see the folder of `out`. What is in memory does not grow with the rows. Beside what was done
    it returns the place of the first row that was left out and why, if it is among the first of a file.
    """
    pa, _ = pyarrow()
    out.parent.mkdir(parents=True, exist_ok=True)
    titles = _titles(paths[0])
    columns = Columns.of(paths[0], by, titles, wishes)
    with TemporaryDirectory(prefix=f".{out.name}.", dir=out.parent) as name:
        folder = Path(name)
        rows, lost = _parted(paths, columns, titles, folder, progress)
        parts = sorted(folder.glob("*.rows"))
        try:
            if not rows:
                raise InputError(f"{paths[0]}: has a header and no rows")
            columns, model, reports, rounding = _learned(columns, gap, parts)
        except InputError as error:
            raise InputError(first_fault(paths, columns) or str(error)) from None
        check_apart(reports.paths, reports.objects, columns.name, rounding, str(paths[0]), "--by COLUMN")
        apart = None if out.suffix else folder / out.name
        job = Job(folder, apart, columns, model, every, gap)
        done = executor.map(smooth_part, [job] * len(parts), parts) if executor else (smooth_part(job, one) for one in parts)
        told, after = Told(rows + lost, lost), iter(done)
        if apart:
            apart.mkdir()
            for part in progress(parts, "smoothing"):
                told += next(after)
                part.unlink()
            apart.rename(out)
        else:
            with unfinished(out) as place, _writer(place, is_columnar(paths[0])) as write:
                for part in progress(parts, "smoothing"):
                    told += next(after)
                    _copy(pa, part.with_suffix(".smooth"), write)
    return told, first_fault(paths, columns) if told.left_out > told.elsewhere else ""


@contextmanager
def processes(workers: int) -> Iterator[Executor | None]:
    """Give processes of this machine; None for one."""
    if workers == 1:
        yield None
        return
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        yield pool


def smooth_part(job: Job, part: Path) -> Told:
    """Smooth the objects of one part, and write them beside it; done again, it writes the same."""
    pa, parquet = pyarrow()
    frame = _frame(part)
    reports = Reports.of(frame, job.columns, job.gap)
    told = Told(left_out=len(frame) - len(reports.rows), elsewhere=int(job.columns.of_others(frame).sum()))
    place = part.with_suffix(".smooth")
    if len(reports.rows):
        result, _ = smoothed_frame(frame, job.columns, reports, job.model, job.every)
        told += Told(
            objects=len(np.unique(reports.codes)), written=len(result),
            pieces=len(result.groupby([job.columns.name, PIECE] if job.columns.name else PIECE, sort=False)),
            gross=int(result[GROSS].sum()) if GROSS in result else 0,
        )  # fmt: skip
        table = pa.Table.from_pandas(result, preserve_index=False)
        if job.apart is not None:
            with unfinished(job.apart / f"{part.stem}{SUFFIX}") as written:
                parquet.write_table(_typed(table, part), written)
            return told
        with unfinished(place) as written, pa.ipc.new_file(str(written), table.schema) as writer:
            writer.write_table(table)
    return told


def _typed(table: Any, part: Path) -> Any:
    """Return a table whose columns without a value are of the type that they were read as: files of a folder agree."""
    pa, _ = pyarrow()
    with pa.OSFile(str(part), "rb") as file:
        given = pa.ipc.open_stream(file).schema
    for i, field in enumerate(table.schema):
        if pa.types.is_null(field.type) and field.name in given.names:
            table = table.set_column(i, field.name, table.column(i).cast(given.field(field.name).type))
    return table


def _frame(part: Path) -> Any:
    pa, _ = pyarrow()
    with pa.OSFile(str(part), "rb") as file:
        return pa.ipc.open_stream(file).read_all().to_pandas()


def first_fault(paths: Sequence[Path], columns: Columns) -> str:
    """Return the place of the first row that cannot be used, and what is wrong with it; "" if none of the first is."""
    axes = Space.of(latitude="deg", longitude="deg") if columns.geodetic else Space.of(x="m", y="m")
    titles = {axis: column.title for axis, column in zip(axes.names, columns.place, strict=True)}
    read = numbers(axes, columns.time.title, titles, {}, "smooth")
    wanted = {column.name: column.title for column in read.values()} | ({"name": columns.name} if columns.name else {})
    wanted |= {f"elsewhere {i}": title for i, title in enumerate(columns.elsewhere)}
    refused: list[Problem] = []
    for path in paths:
        dialect = Dialect() if is_columnar(path) else dialect_of(path)
        given = list(islice(rows_of(path, wanted, "smooth", dialect, refused), LOOKED_AT))
        given = [
            row for row in given if not any(is_number(row.cells[f"elsewhere {i}"]) for i in range(len(columns.elsewhere)))
        ]
        times = Times(read["time"], form_of((row.cells["time"] for row in given), columns.dates), 0.0)
        for row in given:
            try:
                times.of(row)
                for axis in axes.names:
                    read[axis].of(row)
                if columns.name and not row.cells["name"]:
                    raise ValueError(f"{columns.name} must name an object, got ''; --by names another column")
            except ValueError as error:
                refused.append(Problem(row.place, str(error)))
                break
        if refused:
            return str(refused[0])
    return ""


def _titles(path: Path) -> list[str]:
    if is_columnar(path):
        _, parquet = pyarrow()
        check_regular(path)
        titles = [str(name) for name in parquet.read_schema(path).names]
    else:
        titles = [title.strip() for title in dialect_of(path).cells(header_line(lines(path))[1]) or []]
    if twice := [title for i, title in enumerate(titles) if title in titles[:i]]:
        raise InputError(f"{path}: two columns are called {twice[0]!r}: rename one of them")
    return titles


def _parted(
    paths: Sequence[Path], columns: Columns, titles: Sequence[str], folder: Path, progress: Progress
) -> tuple[int, int]:
    """Write the rows of all files to parts of whole objects; return how many there are, and how many cannot be read."""
    pa, _ = pyarrow()
    count = int(np.clip(sum(map(_rows_in, paths)) // ROWS, 1, MOST_PARTS)) if columns.name else 1
    writers: dict[int, Any] = {}
    rows, lost, schema = 0, [0], None
    try:
        for path in progress(list(paths), "reading"):
            if _titles(path) != list(titles):
                raise InputError(f"{path}: has other columns than {paths[0]}")
            for batch in _batches(path, titles, lost):
                schema = schema or batch.schema
                if batch.schema != schema:
                    batch = _cast(path, batch, schema)
                rows += batch.num_rows
                for part, piece in _split(pa, batch, columns.name, count):
                    if part not in writers:
                        writers[part] = pa.ipc.new_stream(str(folder / f"{part:04}.rows"), schema)
                    writers[part].write_batch(piece)
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise InputError(_unread(path) or f"{path}: cannot be read: {error}") from None
    finally:
        for writer in writers.values():
            writer.close()
    return rows, lost[0]


def _split(pa: Any, batch: Any, name: str, count: int) -> Iterator[tuple[int, Any]]:
    """Yield the rows of a batch by the part that their object belongs to."""
    if count == 1:
        yield 0, batch
        return
    coded = batch.column(name).dictionary_encode()
    names = coded.dictionary.cast(pa.string()).to_pylist()
    # Numbers of 16 bits are sorted by their digits, in a tenth of the time.
    of_code = np.array([crc32((code or "").encode()) % count for code in names] + [0], dtype=np.uint16)
    codes = coded.indices.fill_null(len(of_code) - 1).to_numpy(zero_copy_only=False)
    part = of_code[codes]
    order = np.argsort(part, kind="stable")
    ordered = batch.take(pa.array(order))
    edges = np.flatnonzero(np.diff(part[order].astype(int), prepend=-1, append=count))
    for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        yield int(part[order[first]]), ordered.slice(first, last - first)


def _batches(path: Path, titles: Sequence[str], lost: list[int]) -> Iterator[Any]:
    """Yield a file's rows, those of text with each cell as it stands; count those that have too many cells or too few."""
    pa, parquet = pyarrow()
    if is_columnar(path):
        # Buffered by itself, a whole row group would be in memory, however large its writer made it.
        yield from parquet.ParquetFile(path, pre_buffer=False, buffer_size=1 << 20).iter_batches(BATCH)
        return
    csv = needed("pyarrow.csv", "large tables need pyarrow", "data")
    number, _, _ = header_line(lines(path))
    _check_text(path)

    def left_out(row: Any) -> str:
        lost[0] += 1
        return "skip"

    reader = csv.open_csv(
        path,
        read_options=csv.ReadOptions(skip_rows=number, column_names=list(titles), encoding=encoding(path)),
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
            raise InputError(f"{path}:{number}: a quotation mark is not closed: close it, or delete it")


def _cast(path: Path, batch: Any, schema: Any) -> Any:
    """Return a batch in the types of the first file's columns; InputError if that loses something."""
    pa, _ = pyarrow()
    try:
        return pa.Table.from_batches([batch]).cast(schema).to_batches()[0]
    except pa.ArrowException as error:
        raise InputError(f"{path}: its columns are of other types than the first file's: {error}") from None


def _rows_in(path: Path) -> int:
    """Return how many rows a file has, about."""
    if is_columnar(path):
        _, parquet = pyarrow()
        return int(parquet.read_metadata(path).num_rows)
    with path.open("rb") as file:
        start = file.read(1 << 16)
    return int(path.stat().st_size / max(len(start) / max(start.count(b"\n"), 1), 1.0))


def _learned(columns: Columns, gap: float | None, parts: Sequence[Path]) -> tuple[Columns, Model, Reports, float]:
    """Return the columns, the model that the objects in the first parts show, their reports, and the rounding of these."""
    frames, objects = [], 0
    for part in parts[:SAMPLED_PARTS]:
        frames.append(_frame(part))
        objects += frames[-1][columns.name].nunique() if columns.name else 1
        if objects >= OBJECTS:
            break
    pd = needed("pandas", "tables need pandas", "data")
    return learned(pd.concat(frames, ignore_index=True) if len(frames) > 1 else frames[0], columns, gap)


@contextmanager
def _writer(place: Path, columnar: bool) -> Iterator[Any]:
    """Give a function that writes a table to a file, which has the schema of the first."""
    _, parquet = pyarrow()
    csv = needed("pyarrow.csv", "large tables need pyarrow", "data")
    opened: list[Any] = []
    schemas: list[Any] = []

    def write(table: Any) -> None:
        if not opened:
            kind = parquet.ParquetWriter if columnar else csv.CSVWriter
            kwargs = {} if columnar else {"write_options": csv.WriteOptions(quoting_style="needed")}
            opened.append(kind(place, table.schema, **kwargs))
            schemas.append(table.schema)
        opened[0].write_table(table.cast(schemas[0]))

    try:
        yield write
    finally:
        for writer in opened:
            writer.close()


def _copy(pa: Any, part: Path, write: Any) -> None:
    """Hand on what a part was smoothed to, and remove it."""
    if part.exists():
        with pa.OSFile(str(part), "rb") as file:
            reader = pa.ipc.open_file(file)
            for i in range(reader.num_record_batches):
                write(pa.Table.from_batches([reader.get_batch(i)]))
        part.unlink()
    part.with_suffix(".rows").unlink(missing_ok=True)
