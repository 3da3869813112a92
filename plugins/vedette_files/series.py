"""The series of a run: tables of typed columns in one npz archive, written block by block as the run goes.

docs/formats.md lists the tables and their columns.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette.errors import InputError
from vedette.reading import Arrays, open_arrays, parse_json
from vedette_files.growing_zip import append

FORMAT = "vedette series"
VERSION = 1
ABOUT = "about.json"

_BLOCK = 4 * 2**20
"""Bytes of columns that wait in memory before they are written."""
_LEVEL = 1
"""Of compression: more takes several times as long and saves a tenth."""
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
    with _opened(path) as archive:
        return _about(archive)


def read_series(path: Path | str | BinaryIO) -> Series:
    """Read the series that a run wrote, its blocks joined. InputError if it is missing, cut off or of another format."""
    with _opened(path) as archive:
        about = _about(archive)
        parts: dict[tuple[str, str], list[tuple[int, Column]]] = {}
        for member in archive.names:
            if member != ABOUT:
                table, name, block = member.split(".")
                parts.setdefault((table, name), []).append((int(block), archive[member]))
    tables: dict[str, dict[str, Column]] = {}
    for (table, name), blocks in parts.items():
        tables.setdefault(table, {})[name] = np.concatenate([values for _, values in sorted(blocks, key=_number)])
    for table, columns in tables.items():
        if len({len(values) for values in columns.values()}) > 1:
            raise InputError(f"{path}: the columns of {table!r} must have as many rows as each other")
    return Series(about, tables)


@contextmanager
def _opened(path: Path | str | BinaryIO) -> Iterator[Arrays]:
    """Open an archive; InputError for what goes wrong with it."""
    file = Path(path) if isinstance(path, str) else path
    with open_arrays(file, "there is no such file; `vedette run` writes it", "the series of a run") as archive:
        yield archive


def _about(archive: Arrays) -> dict[str, Any]:
    if ABOUT not in archive:
        raise ValueError(f"it has no {ABOUT}")
    about = parse_json(archive.text(ABOUT))
    if not isinstance(about, dict) or (about.get("format"), about.get("version")) != (FORMAT, VERSION):
        raise ValueError(f"this Vedette reads {FORMAT!r} of version {VERSION}")
    return about


def _number(block: tuple[int, Column]) -> int:
    return block[0]
