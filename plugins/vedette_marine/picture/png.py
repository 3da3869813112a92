"""Whether a PNG file is whole, without decoding it."""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def check_png(path: Path) -> tuple[int, int]:
    """Width and height of a PNG of 8 bit whose chunks are there with the right checksums; ValueError if it is not."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    if not data.startswith(SIGNATURE):
        raise ValueError("is no PNG: its first bytes are not those of one")
    at, size, ended = len(SIGNATURE), (0, 0), False
    while not ended:
        if at + 12 > len(data):
            raise ValueError(f"is cut off after {len(data)} bytes")
        (length,) = struct.unpack(">I", data[at : at + 4])
        name, end = data[at + 4 : at + 8], at + 8 + length
        if end + 4 > len(data):
            raise ValueError(f"is cut off after {len(data)} bytes")
        if zlib.crc32(data[at + 4 : end]) != struct.unpack(">I", data[end : end + 4])[0]:
            raise ValueError(f"is corrupted: wrong checksum of the part {name.decode('latin1')!r} at byte {at}")
        if name == b"IHDR":
            width, height, depth = struct.unpack(">IIB", data[at + 8 : at + 17])
            if depth != 8:
                raise ValueError(f"must have 8 bit, got {depth}")
            size = (width, height)
        at, ended = end + 4, name == b"IEND"
    return size
