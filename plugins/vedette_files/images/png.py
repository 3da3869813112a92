"""Whether a PNG file is whole, without decoding it or holding it in memory."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path
from typing import BinaryIO

SIGNATURE = b"\x89PNG\r\n\x1a\n"
BLOCK = 2**20
"""Bytes that are read at once."""


def check_png(path: Path) -> tuple[int, int, int]:
    """Return width, height and bits of a PNG whose chunks are there with the right checksums; ValueError if it is not whole.

    A decoder that is given one that is not may fail, return part of it, or not return at all.
    """
    try:
        if path.exists() and not path.is_file():
            raise ValueError("cannot be read: is no regular file")
        with path.open("rb") as file:
            return _checked(file)
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None


def is_png(path: Path) -> bool:
    """Return whether a file begins as a PNG does, whatever its name."""
    with path.open("rb") as file:
        return file.read(len(SIGNATURE)) == SIGNATURE


def _checked(file: BinaryIO) -> tuple[int, int, int]:
    if file.read(len(SIGNATURE)) != SIGNATURE:
        raise ValueError("is not a PNG: its first bytes are wrong")
    at, size, name = len(SIGNATURE), (0, 0, 0), b""
    while name != b"IEND":
        head = file.read(8)
        if len(head) < 8:
            raise ValueError(f"is cut off after {at + len(head)} bytes")
        length, name = struct.unpack(">I4s", head)
        if at == len(SIGNATURE) and name != b"IHDR":
            raise ValueError("is corrupted: it does not begin with its header")
        first, check = b"", zlib.crc32(name)
        for begin in range(0, length, BLOCK):
            block = file.read(min(BLOCK, length - begin))
            if len(block) < min(BLOCK, length - begin):
                raise ValueError(f"is cut off after {at + 8 + begin + len(block)} bytes")
            first, check = first or block, zlib.crc32(block, check)
        stated = file.read(4)
        if len(stated) < 4:
            raise ValueError(f"is cut off after {at + 8 + length + len(stated)} bytes")
        if check != struct.unpack(">I", stated)[0]:
            raise ValueError(f"is corrupted: wrong checksum of the chunk {name.decode('latin1')!r} at byte {at}")
        if name == b"IHDR":
            if length != 13:
                raise ValueError(f"is corrupted: its header has {length} bytes instead of 13")
            size = struct.unpack(">IIB", first[:9])
        at += 12 + length
    return size
