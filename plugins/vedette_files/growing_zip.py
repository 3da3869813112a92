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
from struct import Struct, pack_into
from typing import BinaryIO

_END = Struct("<4s4H2LH")
"""Signature, two disks, entries of this disk, entries, size and offset of the directory, length of the comment."""
_END64 = Struct("<4sQ2H2L4Q")
"""Signature, length of the rest, two versions, two disks, entries of this disk, entries, size and offset."""
_LOCATOR = Struct("<4sLQL")
"""Signature, disk, offset of the record above, disks."""
_LENGTHS, _NUMBER, _WIDE = Struct("<3H"), Struct("<L"), Struct("<2HQ")
_MOST, _MOST_ENTRIES, _VERSION = 0xFFFFFFFF, 0xFFFF, 45
"""From here on a number stands in a field of 64 bits, which readers of this version of the format know."""
_HEAD, _AT_NEEDED, _AT_LENGTHS, _AT_OFFSET = 46, 6, 28, 42
"""Bytes of an entry of the directory before its name, and where in them some fields are."""


def append(target: Path | BinaryIO, write: Callable[[zipfile.ZipFile], None]) -> None:
    """Let `write` write members into a new archive, and move them to the end of `target`, an archive without a comment.

    An OSError, as of a full disk, leaves the archive as it was.
    """
    fresh = io.BytesIO()
    with zipfile.ZipFile(fresh, "w") as archive:
        write(archive)
    made = fresh.getbuffer()
    count, size, start = _end(fresh)
    with _opened(target) as file:
        entries, length, place = _end(file)
        file.seek(place)
        directory = file.read(length)
    try:
        more = _shifted(bytes(made[start : start + size]), place)
        _put(target, place, made[:start], directory + more, entries + count)
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


def _shifted(directory: bytes, by: int) -> bytes:
    """Return a directory whose members stand `by` bytes further on."""
    found, at = bytearray(), 0
    while at < len(directory):
        name, extra, comment = _LENGTHS.unpack_from(directory, at + _AT_LENGTHS)
        entry = bytearray(directory[at : at + _HEAD + name + extra + comment])
        at += len(entry)
        place = _NUMBER.unpack_from(entry, _AT_OFFSET)[0] + by
        _NUMBER.pack_into(entry, _AT_OFFSET, min(place, _MOST))
        if place >= _MOST:
            pack_into("<H", entry, _AT_NEEDED, _VERSION)
            _LENGTHS.pack_into(entry, _AT_LENGTHS, name, extra + _WIDE.size, comment)
            entry[_HEAD + name : _HEAD + name] = _WIDE.pack(1, 8, place)
        found += entry
    return bytes(found)
