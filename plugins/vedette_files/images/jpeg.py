"""Whether a JPEG file is whole, without decoding it: a decoder fills what is cut off with grey and says nothing."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

BEGIN, END = b"\xff\xd8\xff", b"\xff\xd9"
SCAN = 0xDA
"""The marker before the first pixels: what lies in segments before it, as a thumbnail with an end of its own, is skipped."""
BLOCK = 2**20
"""Bytes that are searched at once."""


def check_jpeg(path: Path) -> None:
    """Raise ValueError for a JPEG whose end is missing, or that has no pixels."""
    with path.open("rb") as file:
        _to_pixels(file)
        before = b""
        while block := file.read(BLOCK):
            if END in before + block:
                return
            before = block[-1:]
        raise ValueError(f"is cut off after {file.tell()} bytes: the mark of its end is missing")


def is_jpeg(path: Path) -> bool:
    """Return whether a file begins as a JPEG does, whatever its name."""
    with path.open("rb") as file:
        return file.read(len(BEGIN)) == BEGIN


def segments(file: BinaryIO) -> Iterator[int]:
    """Yield the marker of each segment, the file standing at the segment's content; ValueError where none begins."""
    file.seek(2)
    try:
        while True:
            mark, kind = struct.unpack("BB", file.read(2))
            while kind == 0xFF:
                (kind,) = struct.unpack("B", file.read(1))
            (length,) = struct.unpack(">H", file.read(2))
            if mark != 0xFF or length < 2:
                raise ValueError(f"is corrupted: no segment begins at byte {file.tell() - 4}")
            end = file.tell() + length - 2
            yield kind
            file.seek(end)
    except struct.error:
        raise ValueError(f"is cut off after {file.tell()} bytes: it has no pixels") from None


def _to_pixels(file: BinaryIO) -> None:
    """Go to the content of the segment before the first pixels, which holds no mark of an end."""
    for kind in segments(file):
        if kind == SCAN:
            return
