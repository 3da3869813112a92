"""Arrays in npz files, read up to stated limits: what a header says of its size is checked before anything is made of it.

Results that are read back are data from elsewhere, as recordings are. What is wrong with one is an InputError that names it.
"""

from __future__ import annotations

import math
import os
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import IO, Any, BinaryIO, final

import numpy as np
from numpy.typing import NDArray

from vedette.errors import InputError
from vedette.limits import most

LARGEST_ARRAYS, MOST_UNPACKED = 2**27, 32
"""Bytes that arrays of a file may take in memory, or so many times its size if that is more: those of runs take 2 to 8."""

MOST_MEMBERS = 2_000_000
"""Arrays in one file."""


@final
class Arrays:
    """The arrays of an npz file, read one by one; all headers fit the limits by then."""

    def __init__(self, archive: zipfile.ZipFile, size: int, largest: int) -> None:
        self._archive = archive
        members = archive.infolist()
        if len(members) > most(MOST_MEMBERS):
            raise ValueError(f"has more than {most(MOST_MEMBERS):,} parts")
        limit = max(most(largest), most(MOST_UNPACKED) * size)
        if (total := sum(member.file_size for member in members)) > limit:
            raise ValueError(f"unpacks to {total:,} bytes, and at most {limit:,} are read; --limits raises that")
        self._members = {member.filename.removesuffix(".npy"): member for member in members}
        if len(self._members) < len(members):
            raise ValueError("has two parts of one name")

    @property
    def names(self) -> list[str]:
        """What there is, in the order of the file."""
        return list(self._members)

    def __contains__(self, name: str) -> bool:
        return name in self._members

    def __getitem__(self, name: str) -> NDArray[Any]:
        """Return an array. ValueError if it is not there, cut, altered or of objects."""
        with self._opened(name) as file:
            shape, by_columns, dtype = _header(file, name)
            size = self._members[name].file_size
            if math.prod(shape) * dtype.itemsize != size - file.tell():
                raise ValueError(f"{name!r} says that it holds {shape} of {dtype}, which its {size:,} bytes are not")
            values = np.frombuffer(file.read(), dtype).copy()
        return values.reshape(shape, order="F" if by_columns else "C")

    def head(self, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
        """Return shape and type of an array, which is not read."""
        with self._opened(name) as file:
            shape, _, dtype = _header(file, name)
        return shape, dtype

    def text(self, name: str) -> str:
        """Return a part that is text."""
        return self._archive.read(self._members[name]).decode("utf-8")

    def _opened(self, name: str) -> IO[bytes]:
        if name not in self._members:
            raise ValueError(f"has no {name!r}")
        return self._archive.open(self._members[name])


_HEAD = re.compile(
    r"\{'descr': '([<>|=][biufcSU][0-9]{1,9})', 'fortran_order': (True|False), "
    r"'shape': \(((?:[0-9]{1,18}, ?)*(?:[0-9]{1,18})?)\), \} *\n?"
)
"""The header of an array of numbers or texts, as numpy writes it: its own reader evaluates it as Python's literals.

A text matches it in one way at most, as searching through many takes for ever.
"""


def _header(file: IO[bytes], name: str) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    begin = file.read(10)
    if begin[:8] != b"\x93NUMPY\x01\x00" or len(begin) < 10:
        raise ValueError(f"{name!r} is no array of numpy's format 1.0")
    header = _HEAD.fullmatch(file.read(int.from_bytes(begin[8:], "little")).decode("latin-1"))
    if header is None:
        raise ValueError(f"{name!r} has a header that numpy writes for no array of numbers or texts")
    return tuple(map(int, re.findall("[0-9]+", header[3]))), header[2] == "True", np.dtype(header[1])


@contextmanager
def open_arrays(
    path: Path | BinaryIO,
    missing: str = "there is no such file",
    what: str = "an npz file of arrays",
    largest: int = LARGEST_ARRAYS,
) -> Iterator[Arrays]:
    """Open an npz file of arrays; InputError for whatever is wrong with it, also while its arrays are read.

    It may be open already. `missing` is told where it is not there, `what` it must be. Its arrays may take `largest` bytes,
    or MOST_UNPACKED times the size of the file if that is more.
    """
    try:
        if isinstance(path, Path) and path.exists() and not path.is_file():
            raise InputError(f"{path}: is no regular file")
        with path.open("rb") if isinstance(path, Path) else nullcontext(path) as file, zipfile.ZipFile(file) as archive:
            yield Arrays(archive, file.seek(0, os.SEEK_END), largest)
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: {missing}") from None
    except InputError:
        raise
    except _WRONG as error:
        raise InputError(f"{path}: must be {what}: {' '.join(str(error).split())[:300]}") from None


_WRONG = (
    OSError, ValueError, KeyError, IndexError, EOFError, TypeError, OverflowError, NotImplementedError, RuntimeError,
    struct.error, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""What zipfile raises for files that are not whole."""
