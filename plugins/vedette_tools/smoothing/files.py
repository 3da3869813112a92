"""Files of named positions, smoothed: rows in the order of time are put together by object on disk first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zlib import crc32

import numpy as np
from attrs import astuple, frozen

from vedette.errors import InputError
from vedette.progress import Progress
from vedette_files.libraries import needed
from vedette_files.tables.columnar import SUFFIX, pyarrow
from vedette_files.writing import folder_beside, naming, unfinished
from vedette_study.executors import worked_elsewhere
from vedette_tools.drafting.recognising import NO_WISHES
from vedette_tools.drafting.wishes import Wishes
from vedette_tools.smoothing.batches import batches, cast, rows_in, titles_of
from vedette_tools.smoothing.clocks import set_back
from vedette_tools.smoothing.columns import Columns
from vedette_tools.smoothing.faults import first_fault
from vedette_tools.smoothing.noises import Model
from vedette_tools.smoothing.several_objects import check_apart
from vedette_tools.smoothing.table import Reports, learned, smoothed_rows

ROWS, MOST_PARTS = 50_000, 200
"""Rows of a part, all of some objects, and how many parts there are at most: as many files are open at once."""

OBJECTS, SAMPLED_PARTS = 100, 8
"""The model is that of so many objects, or of those in so many parts."""


@frozen
class Job:
    """What is smoothed and how, for a worker: the folder of the parts, and that of Parquet files if each part becomes one,
    the table's columns, the model, the deviation in m of what digits leave out at least, and what is asked.
    """

    folder: Path
    apart: Path | None
    columns: Columns
    model: Model
    rounding: float
    every: float | None
    gap: float | None


@frozen
class Told:
    """What was done: rows read, rows left out, those of them of sensors that measure no positions, objects, those that seem
    to be several, pieces, gross positions, rows written.
    """

    rows: int = 0
    left_out: int = 0
    elsewhere: int = 0
    objects: int = 0
    mixed: int = 0
    pieces: int = 0
    gross: int = 0
    written: int = 0

    def __add__(self, other: Told) -> Told:
        return Told(*(mine + others for mine, others in zip(astuple(self), astuple(other), strict=True)))


def smooth_files(
    paths: Sequence[Path],
    out: Path,
    by: str | None,
    every: float | None,
    gap: float | None,
    executor: Executor | None,
    progress: Progress,
    wishes: Wishes = NO_WISHES,
) -> tuple[Told, str, tuple[str, ...], str]:
    """Smooth the positions in files of one kind, as if they were one, and write them to `out`, by object and time.

    A name without a suffix is a new folder, of a Parquet file for each part: workers write these, and nothing is gathered.
    An executor's workers must see the folder of `out`. What is in memory does not grow with the rows. Beside what was done
    it returns the place of the first row that was left out and why, if it is among the first of a file; guesses; and where
    times of one of the first objects go back as a clock that was set back.
    """
    pa, _ = pyarrow()
    out.parent.mkdir(parents=True, exist_ok=True)
    titles = titles_of(paths[0])
    columns = Columns.of(paths[0], by, titles, wishes)
    with naming(out), folder_beside(out, "--out") as folder:
        rows, lost = _parted(paths, columns, titles, folder, progress)
        parts = sorted(folder.glob("*.rows"))
        try:
            if not rows:
                raise InputError(f"{paths[0]}: has a header and no rows")
            columns, model, reports, back = _learned(columns, gap, parts)
        except InputError as error:
            raise InputError(first_fault(paths, columns) or str(error)) from None
        rounding = reports.rounding
        check_apart(reports.paths, reports.objects, columns.name, reports.roundings(rounding), str(paths[0]), "--by COLUMN")
        apart = None if out.suffix else folder / out.name
        job = Job(folder, apart, columns, model, rounding, every, gap)
        told, after = Told(rows + lost, lost), _done(executor, job, parts)
        if apart:
            apart.mkdir()
            for part in progress(parts, "smoothing"):
                told += next(after)
                part.unlink()
            apart.rename(out)
        else:
            place = folder / out.name
            with _writer(place, paths[0].suffix.lower() == SUFFIX) as write:
                for part in progress(parts, "smoothing"):
                    told += next(after)
                    _copy(pa, part.with_suffix(".smooth"), write)
            place.replace(out)
    return told, first_fault(paths, columns) if told.left_out > told.elsewhere else "", columns.assumed, back


def _done(executor: Executor | None, job: Job, parts: Sequence[Path]) -> Iterator[Told]:
    """Yield what was done with each part, by an executor's workers if there is one."""
    if executor is None:
        yield from (smooth_part(job, one) for one in parts)
        return
    with worked_elsewhere():
        yield from executor.map(smooth_part, [job] * len(parts), parts)


def smooth_part(job: Job, part: Path) -> Told:
    """Smooth the objects of one part, and write them beside it; done again, it writes the same."""
    pa, parquet = pyarrow()
    given = _table(part)
    frame = _frame(given, job.columns)
    reports = Reports.of(frame, job.columns, job.gap)
    told = Told(left_out=len(frame) - len(reports.rows), elsewhere=int(job.columns.of_others(frame).sum()))
    if not len(reports.rows):
        return told
    smooth = smoothed_rows(frame, job.columns, reports, job.model, job.rounding, job.every)
    told += Told(
        objects=len(np.unique(reports.codes)), written=len(smooth.rows), mixed=len(smooth.mixed),
        pieces=len(np.unique(np.stack([smooth.codes, smooth.piece]), axis=1).T),
        gross=smooth.gross,
    )  # fmt: skip
    kept = given.take(pa.array(smooth.rows))
    titles = dict.fromkeys([*given.column_names, *smooth.cells])
    table = pa.table(
        {title: smooth.cells.get(title, kept[title] if title in kept.column_names else None) for title in titles}
    )
    if job.apart is not None:
        with unfinished(job.apart / f"{part.stem}{SUFFIX}") as place:
            parquet.write_table(table, place)
    else:
        with unfinished(part.with_suffix(".smooth")) as place, pa.ipc.new_file(str(place), table.schema) as writer:
            writer.write_table(table)
    return told


def _table(part: Path) -> Any:
    pa, _ = pyarrow()
    with pa.OSFile(str(part), "rb") as file:
        return pa.ipc.open_stream(file).read_all()


def _frame(table: Any, columns: Columns) -> Any:
    """Return the columns of a table that are read; whole numbers stay whole where some are missing."""
    return table.select([*dict.fromkeys([*columns.read, *columns.elsewhere])]).to_pandas(integer_object_nulls=True)


def _parted(
    paths: Sequence[Path], columns: Columns, titles: Sequence[str], folder: Path, progress: Progress
) -> tuple[int, int]:
    """Write the rows of all files to parts of whole objects; return how many there are, and how many cannot be read."""
    pa, _ = pyarrow()
    count = int(np.clip(sum(map(rows_in, paths)) // ROWS, 1, MOST_PARTS)) if columns.name else 1
    writers: dict[int, Any] = {}
    rows, lost, schema = 0, [0], None
    try:
        for path in progress(list(paths), "reading"):
            for batch in batches(path, titles, lost):
                schema = schema or batch.schema
                if batch.schema != schema:
                    batch = cast(path, batch, schema)
                rows += batch.num_rows
                for part, piece in _split(pa, batch, columns.name, count):
                    if part not in writers:
                        writers[part] = pa.ipc.new_stream(str(folder / f"{part:04}.rows"), schema)
                    writers[part].write_batch(piece)
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


def _learned(columns: Columns, gap: float | None, parts: Sequence[Path]) -> tuple[Columns, Model, Reports, str]:
    """Return the columns, the model that the objects in the first parts show, these, and where a clock was set back."""
    frames, objects = [], 0
    for part in parts[:SAMPLED_PARTS]:
        frames.append(_frame(_table(part), columns))
        objects += frames[-1][columns.name].nunique() if columns.name else 1
        if objects >= OBJECTS:
            break
    pd = needed("pandas", "tables need pandas", "data")
    frame = pd.concat(frames, ignore_index=True) if len(frames) > 1 else frames[0]
    return *learned(frame, columns, gap), set_back(frame, columns)


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
