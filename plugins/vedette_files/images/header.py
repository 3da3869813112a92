"""How large a picture says it is, without decoding it: a small file may unpack to more than fits into memory."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import BinaryIO

from vedette.limits import most
from vedette_files.images.jpeg import segments

MOST_PIXELS = 2**26
"""Pixels of a picture: 8192 x 8192. Twenty times a 4K screen's would be an accident or an attack."""

_NO_FRAME = (0xC4, 0xC8, 0xCC)
"""JPEG markers from C0 to CF that do not tell the size."""

TIFF = b"II*\0", b"MM\0*"
"""How TIFF files begin."""


def check_pixels(width: int, height: int) -> None:
    """Raise ValueError for a picture that is larger than MOST_PIXELS, or empty."""
    limit = most(MOST_PIXELS)
    if width < 1 or height < 1 or width * height > limit:
        raise ValueError(f"must have 1 pixel or more and not more than {limit:,} pixels, got {width} x {height}")


def picture_size(path: Path) -> tuple[int, int] | None:
    """Return width and height from the header of a PNG, JPEG, BMP, PGM or TIFF file; None if it is none of them."""
    with path.open("rb") as file:
        head = file.read(32)
        try:
            if head.startswith(b"\x89PNG\r\n\x1a\n"):
                width, height = struct.unpack(">II", head[16:24])
            elif head.startswith(b"BM"):
                width, height = _bmp(head)
            elif head[:2] in (b"P1", b"P2", b"P3", b"P4", b"P5", b"P6"):
                width, height = _pnm(file)
            elif head.startswith(b"\xff\xd8"):
                width, height = _jpeg(file)
            elif head[:4] in TIFF:
                width, height = _tiff(file, "<" if head.startswith(b"II") else ">")
            else:
                return None
        except (struct.error, ValueError, KeyError):
            return None
    return width, height


def _bmp(head: bytes) -> tuple[int, int]:
    if struct.unpack("<I", head[14:18])[0] == 12:
        width, height = struct.unpack("<HH", head[18:22])
    else:
        width, height = struct.unpack("<ii", head[18:26])
    return abs(width), abs(height)  # rows run down where the height is negative


def _pnm(file: BinaryIO) -> tuple[int, int]:
    file.seek(2)
    words = [word for line in file.read(65536).split(b"\n")[:100] for word in line.partition(b"#")[0].split()]
    width, height, *_ = map(int, words[:2])
    return width, height


def _jpeg(file: BinaryIO) -> tuple[int, int]:
    for kind in segments(file):
        if 0xC0 <= kind <= 0xCF and kind not in _NO_FRAME:
            height, width = struct.unpack(">xHH", file.read(5))
            return width, height
    raise ValueError


def _tiff(file: BinaryIO, order: str) -> tuple[int, int]:
    """Return the size of the first picture of the file, which is the one that is read."""
    file.seek(4)
    file.seek(struct.unpack(f"{order}I", file.read(4))[0])
    (count,) = struct.unpack(f"{order}H", file.read(2))
    sizes = {}
    for _ in range(count):
        tag, kind, _count, value = struct.unpack(f"{order}HHI4s", file.read(12))
        if tag in (256, 257):
            sizes[tag] = struct.unpack(f"{order}{'H' if kind == 3 else 'I'}", value[: 2 if kind == 3 else 4])[0]
    return sizes[256], sizes[257]


def tiff_pages(path: Path) -> tuple[int, bool]:
    """Return how many pages a TIFF file lists, and whether the file ends, or returns to a page, before their list does.

    None of what is no TIFF file.
    """
    with path.open("rb") as file:
        head = file.read(4)
        if head not in TIFF:
            return 0, False
        order = "<" if head.startswith(b"II") else ">"
        seen: set[int] = set()
        try:
            (at,) = struct.unpack(f"{order}I", file.read(4))
            while at and at not in seen:
                file.seek(at)
                (count,) = struct.unpack(f"{order}H", file.read(2))
                file.seek(12 * count, 1)
                (after,) = struct.unpack(f"{order}I", file.read(4))
                seen.add(at)
                at = after
        except struct.error:
            return len(seen), True
    return len(seen), at != 0
