"""Members appended to a zip archive whose directory never stands in memory as objects.

`zipfile` reads all entries of the directory in order to append: for a run of a day these are tens of thousands, again for
each block of it. Here they are moved as bytes.
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from struct import Struct
from typing import BinaryIO

_END = Struct("<4s4H2LH")
"""Signature, two disks, entries of this disk, entries, size and offset of the directory, length of the comment."""
_END64 = Struct("<4sQ2H2L4Q")
"""Signature, length of the rest, two versions, two disks, entries of this disk, entries, size and offset."""
_LOCATOR = Struct("<4sLQL")
"""Signature, disk, offset of the record above, disks."""
_MOST, _MOST_ENTRIES, _VERSION = 0xFFFFFFFF, 0xFFFF, 45
"""From here on a number stands in a field of 64 bits, which readers of this version of the format know."""


class _Placed(io.BytesIO):
    """A file whose places count from `start` on: so zipfile itself writes where the members stand once they are moved."""

    def __init__(self, start: int) -> None:
        super().__init__()
        self._start = start

    def tell(self) -> int:
        return super().tell() + self._start

    def seek(self, place: int, whence: int = io.SEEK_SET, /) -> int:
        return super().seek(place - (0 if whence else self._start), whence) + self._start


def append(target: Path | BinaryIO, write: Callable[[zipfile.ZipFile], None]) -> None:
    """Let `write` write members into a new archive, and move them to the end of `target`, an archive without a comment.

    An OSError, as of a full disk, leaves the archive as it was.
    """
    with _opened(target) as file:
        entries, length, place = _end(file)
        file.seek(place)
        directory = file.read(length)
    fresh = _Placed(place)
    with zipfile.ZipFile(fresh, "w") as archive:
        write(archive)
    made = fresh.getbuffer()
    count, size, start = _end(fresh)
    more = made[start - place : start - place + size]
    try:
        _put(target, place, made[: start - place], directory + more, entries + count)
    except OSError:
        _put(target, place, b"", directory, entries)
        raise


def _opened(target: Path | BinaryIO) -> AbstractContextManager[BinaryIO]:
    return target.open("r+b") if isinstance(target, Path) else nullcontext(target)


def _put(target: Path | BinaryIO, place: int, members: bytes | memoryview, directory: bytes, entries: int) -> None:
    with _opened(target) as file:
        file.seek(place)
        file.write(members)
        file.write(directory)
        file.write(end_record(entries, len(directory), place + len(members)))
        file.truncate()


def end_record(entries: int, size: int, offset: int) -> bytes:
    """Return what stands behind a directory of so many entries and bytes at `offset`."""
    plain = _END.pack(b"PK\5\6", 0, 0, *(min(entries, _MOST_ENTRIES),) * 2, min(size, _MOST), min(offset, _MOST), 0)
    if entries < _MOST_ENTRIES and size < _MOST and offset < _MOST:
        return plain
    wide = _END64.pack(b"PK\6\6", _END64.size - 12, _VERSION, _VERSION, 0, 0, entries, entries, size, offset)
    return wide + _LOCATOR.pack(b"PK\6\7", 0, offset + size, 1) + plain


def _end(file: BinaryIO) -> tuple[int, int, int]:
    """Return the entries of the directory, its bytes, and where it begins. BadZipFile if the archive is cut off."""
    begin = file.seek(-_END.size, io.SEEK_END)
    signature, _, _, _, entries, size, offset, _ = _END.unpack(file.read(_END.size))
    if signature != b"PK\5\6":
        raise zipfile.BadZipFile("the archive's end is missing")
    if entries < _MOST_ENTRIES and size < _MOST and offset < _MOST:
        return entries, size, offset
    file.seek(begin - _LOCATOR.size)
    file.seek(_LOCATOR.unpack(file.read(_LOCATOR.size))[2])
    return _END64.unpack(file.read(_END64.size))[-3:]
