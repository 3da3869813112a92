"""The series of a run: tables of typed columns in one npz archive, written block by block as the run goes.

docs/reference/series.md lists the tables and their columns.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette.errors import InputError
from vedette_files.archives import Arrays, open_arrays
from vedette_files.growing_zip import append, mended
from vedette_files.json_values import parse
from vedette_files.results import UNFINISHED

FORMAT = "vedette series"
VERSION = 1
ABOUT = "about.json"

_BLOCK = 4 * 2**20
"""Bytes of columns that wait in memory before they are written."""
_LEVEL = 1
"""Of compression: more takes several times as long and saves a tenth."""
_RAGGED = "the columns of {!r} must have as many rows as each other"
_EPOCH = (1980, 1, 1, 0, 0, 0)

Column = NDArray[Any]
Tables = Mapping[str, Mapping[str, Column]]


@final
class SeriesFile:
    """An archive that grows. It is whole after each block, so a run that is killed leaves all but its last block."""

    def __init__(self, target: Path | BinaryIO, about: Mapping[str, Any]) -> None:
        self._target, self._block = target, 0
        self._waiting: dict[str, list[Column]] = {}
        self._bytes = 0
        head = {"format": FORMAT, "version": VERSION, **about}
        with zipfile.ZipFile(target, "w") as archive:
            archive.writestr(_member(ABOUT), json.dumps(head, allow_nan=False), compresslevel=_LEVEL)

    def add(self, tables: Tables) -> None:
        """Append rows to some tables: of each the same columns every time, and as many rows in each of them."""
        for table, columns in tables.items():
            for name, values in columns.items():
                self._waiting.setdefault(f"{table}.{name}", []).append(values)
                self._bytes += values.nbytes
        if self._bytes >= _BLOCK:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        if not self._waiting:
            return
        append(self._target, self._write)
        self._waiting, self._bytes, self._block = {}, 0, self._block + 1

    def _write(self, archive: zipfile.ZipFile) -> None:
        for name, parts in self._waiting.items():
            content = io.BytesIO()
            np.lib.format.write_array(content, np.ascontiguousarray(np.concatenate(parts)), allow_pickle=False)
            archive.writestr(_member(f"{name}.{self._block}.npy"), content.getvalue(), compresslevel=_LEVEL)


def _member(name: str) -> zipfile.ZipInfo:
    """Return the head of a member without the time of day, so that equal runs give equal bytes."""
    info = zipfile.ZipInfo(name, _EPOCH)
    info.compress_type = zipfile.ZIP_DEFLATED
    return info


@frozen(eq=False)
class Series:
    """The tables of a run, `tables["entries"]["nis"]`, and what is the same in all of it: `about`."""

    about: dict[str, Any]
    tables: dict[str, dict[str, Column]]

    def __getitem__(self, table: str) -> dict[str, Column]:
        if table not in self.tables:
            raise InputError(f"the series have no table {table!r}: a run has them from its first complete block on")
        return self.tables[table]


def read_about(path: Path | str) -> dict[str, Any]:
    """Read what is the same in all of a run's series; InputError as from `read_series`."""
    with open_series(path) as arrays:
        return arrays.about


def read_series(path: Path | str | BinaryIO) -> Series:
    """Read the series that a run wrote, its blocks joined. InputError if it is missing, cut off or of another format."""
    with open_series(path) as arrays:
        parts: dict[str, dict[str, list[Column]]] = {}
        for block in arrays.blocks():
            for table, columns in block.items():
                for name, values in columns.items():
                    parts.setdefault(table, {}).setdefault(name, []).append(values)
        return Series(
            arrays.about,
            {table: {name: np.concatenate(blocks) for name, blocks in columns.items()} for table, columns in parts.items()},
        )


@final
class SeriesBlocks:
    """The series of a run, open: read block by block, so that a run of any length fits into memory.

    `about` as in Series. A run that was killed while it wrote a block has those before it.
    """

    def __init__(self, archive: Arrays) -> None:
        self._archive, self.about = archive, _about(archive)
        self._names = dict[int, dict[str, list[str]]]()
        known = dict[str, set[str]]()
        for member in archive.names:
            if member != ABOUT:
                table, name, block = member.split(".")
                self._names.setdefault(int(block), {}).setdefault(table, []).append(name)
                known.setdefault(table, set()).add(name)
        for tables in self._names.values():
            for table, names in tables.items():
                if len(names) < len(known[table]):
                    raise ValueError(_RAGGED.format(table))

    def rows(self) -> dict[str, int]:
        """Return how many rows each table has in all, without reading them."""
        count: dict[str, int] = {}
        for block, tables in self._names.items():
            for table, names in tables.items():
                (rows, *_), _ = self._archive.head(f"{table}.{names[0]}.{block}")
                count[table] = count.get(table, 0) + rows
        return count

    def blocks(self) -> Iterator[dict[str, dict[str, Column]]]:
        """Yield the tables of one block after the other; ValueError if columns of a table have other rows than others."""
        for block, tables in sorted(self._names.items()):
            found = {
                table: {name: self._archive[f"{table}.{name}.{block}"] for name in names} for table, names in tables.items()
            }
            for table, columns in found.items():
                if len({values.shape[:1] for values in columns.values()}) > 1 or () in map(np.shape, columns.values()):
                    raise ValueError(_RAGGED.format(table))
            yield found


@contextmanager
def open_series(path: Path | str | BinaryIO) -> Iterator[SeriesBlocks]:
    """Open the series that a run wrote; InputError for whatever is wrong with it, also while its blocks are read."""
    file = Path(path) if isinstance(path, str) else path
    missing, what = "there is no such file; `vedette run` writes it", "the series of a run"
    with ExitStack() as stack:
        if isinstance(file, Path) and file.parent.name.startswith(UNFINISHED) and _cut(file):
            file = mended(stack.enter_context(file.open("rb")), _whole_blocks)
        yield SeriesBlocks(stack.enter_context(open_arrays(file, missing, what)))


def _cut(path: Path) -> bool:
    """Return whether an archive lost its end."""
    with suppress(Exception):  # whatever else is wrong with it is told when it is opened
        try:
            zipfile.ZipFile(path).close()
        except zipfile.BadZipFile:
            return True
    return False


def _whole_blocks(names: list[str]) -> int:
    """Return how many members the blocks before the last one have: that one was being written."""
    blocks = [name.removesuffix(".npy").rpartition(".")[2] for name in names]
    return blocks.index(blocks[-1]) if len(blocks) > 1 else len(blocks)


def _about(archive: Arrays) -> dict[str, Any]:
    if ABOUT not in archive:
        raise ValueError(f"it has no {ABOUT}")
    about = parse(archive.text(ABOUT))
    if not isinstance(about, dict) or (about.get("format"), about.get("version")) != (FORMAT, VERSION):
        raise ValueError(f"this Vedette reads {FORMAT!r} of version {VERSION}")
    return about
