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
from typing import Any, BinaryIO

_END = Struct("<4s4H2LH")
"""Signature, two disks, entries of this disk, entries, size and offset of the directory, length of the comment."""
_END64 = Struct("<4sQ2H2L4Q")
"""Signature, length of the rest, two versions, two disks, entries of this disk, entries, size and offset."""
_LOCATOR = Struct("<4sLQL")
"""Signature, disk, offset of the record above, disks."""
_LOCAL = Struct("<4s5H3L2H")
"""Signature, version, flags, method, time, date, sum, bytes packed and unpacked, lengths of name and of what follows it."""
_ENTRY = Struct("<4s6H3L5H2L")
"""The same in the directory, with the version that made it, and at the end where the member begins."""
_WIDE = Struct("<2HQ")
"""What follows a name in the directory where the place does not fit above: its kind, length, and the place."""
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


def mended(file: BinaryIO, keep: Callable[[list[str]], int]) -> Any:
    """Return an archive that was cut while it was appended to, with its first members alone: `keep` says how many.

    The directory is gone by then: each member's own head tells its name and sizes. The file stays as it is.
    """
    places, names, entries = [0], list[str](), list[bytes]()
    end = file.seek(0, io.SEEK_END)
    while (place := places[-1]) + _LOCAL.size <= end:
        file.seek(place)
        signature, *told, packed, unpacked, length, more = _LOCAL.unpack(file.read(_LOCAL.size))
        name = file.read(length)
        after = place + _LOCAL.size + length + more + packed
        if signature != b"PK\3\4" or after > end or more:  # ours have nothing after their names
            break
        wide = _WIDE.pack(1, 8, place) if place >= _MOST else b""
        sizes = packed, unpacked, length, len(wide), 0, 0, 0, 0, min(place, _MOST)
        entries.append(_ENTRY.pack(b"PK\1\2", _VERSION, *told, *sizes) + name + wide)
        names.append(name.decode("utf-8", "replace"))
        places.append(after)
    kept = keep(names)
    directory = b"".join(entries[:kept])
    return _Cut(file, places[kept], directory + end_record(kept, len(directory), places[kept]))


class _Cut(io.RawIOBase):
    """The first bytes of a file, and others after them."""

    def __init__(self, file: BinaryIO, size: int, more: bytes) -> None:
        self._file, self._size, self._more, self._place = file, size, more, 0

    def __str__(self) -> str:
        return str(self._file.name)

    def seek(self, place: int, whence: int = io.SEEK_SET, /) -> int:
        self._place = max(place + (0, self._place, self._size + len(self._more))[whence], 0)
        return self._place

    def tell(self) -> int:
        return self._place

    def seekable(self) -> bool:
        return True

    def readable(self) -> bool:
        return True

    def read(self, count: int | None = -1, /) -> bytes:
        begin, whole = self._place, self._size + len(self._more)
        stop = whole if count is None or count < 0 else min(begin + count, whole)
        self._file.seek(begin)
        content = self._file.read(max(min(stop, self._size) - begin, 0))
        content += self._more[max(begin - self._size, 0) : max(stop - self._size, 0)]
        self._place = begin + len(content)
        return content


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
