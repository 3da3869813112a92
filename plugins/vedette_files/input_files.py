"""Which files are read, and how much of them: regular files, in the folder that was named, up to stated ceilings.

Recordings are data from elsewhere. What they name stays in their folder, links included, and no device, pipe or endless line
can hold or fill the machine.
"""

from __future__ import annotations

import errno
import os
from codecs import getincrementaldecoder
from collections.abc import Iterator
from pathlib import Path

from vedette.errors import InputError
from vedette.limits import most as raised

LONGEST_LINE = 2**25
"""Characters of a line; a scan of 100,000 returns with their covariances takes a third of it."""

AS_CSV = ", not text: save the table as CSV"

NOT_TEXT = {
    b"PAR1": "is a Parquet file: its name must end in .parquet",
    b"PK\x03\x04": f"is an Excel workbook or a ZIP archive{AS_CSV}, or unpack it",
    b"\xd0\xcf\x11\xe0": f"is an old Excel workbook{AS_CSV}",
    b"\x1f\x8b": "is compressed by gzip: unpack it",
    b"\x89HDF": f"is an HDF5 file{AS_CSV} or Parquet",
    b"MATLAB 5.0": f"is a file of MATLAB{AS_CSV} or Parquet",
    b"SQLite format 3": f"is a database of SQLite{AS_CSV}, with a row for each return",
    b"\x93NUMPY": f"is an array of numpy{AS_CSV}, with titles",
    b"#ROSBAG": f"is a recording of ROS{AS_CSV}, a topic in each file",
    b"ULog": f"is a log of PX4{AS_CSV}, as ulog2csv does",
    b"CCSDS_OEM": "is a CCSDS ephemeris, an object after each META_START, in km: write one table, as id,time,x,y,z",
    b"CCSDS_TDM": "is a CCSDS message, each quantity in a line of its own: write a row for each time, as time,range,bearing",
    b"\xd4\xc3\xb2\xa1": "holds packets of a network, not text: decode what they hold, as ASTERIX, to CSV or JSON",
}
"""How files begin that are taken for text, and what to do with them."""

UTF_16 = (b"\xff\xfe", b"\xfe\xff")
"""How text begins that Windows calls Unicode."""

FIRST = 2**16
"""Bytes of the first line, at most, that say how a text is encoded."""

WESTERN = "cp1252"
"""How a text is taken to be encoded that is not Unicode: Latin-1 with more signs."""

LARGEST_WHOLE = 2**28
"""Bytes of a file that is read whole: a JSON file takes some twenty times as much memory."""


def user_path(path: str) -> Path:
    """Return the path that a user wrote, `~` and `~name` expanded; ValueError if it can be none."""
    try:
        file = Path(path).expanduser()
        file.exists()
    except RuntimeError:
        raise ValueError(f"there is no home folder for {path.split('/')[0]!r}") from None
    except OSError as error:
        raise ValueError(f"{shown(path)} cannot be looked up: {error.strerror}") from None
    return file


def inside(folder: Path, name: str) -> Path:
    """Return the file `name` in `folder`; ValueError if its name, or a link, leads out of the folder."""
    try:
        file = folder / name
        stays = file.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError) as error:
        raise ValueError(f"{shown(name)} cannot be looked up: {error}") from None
    if not stays:
        raise ValueError(
            f"{shown(name)} leads out of the folder {str(folder)!r}, which must hold all files of the recording"
        )
    return file


def check_regular(path: Path) -> None:
    """Raise InputError unless `path` is a file of bytes: a folder, a pipe or a device is not read."""
    try:
        if path.is_file():
            return
        there = path.exists()
    except OSError as error:
        raise InputError(f"{path}: cannot be looked up: {error.strerror}") from None
    if not there:
        raise InputError(f"{path}: cannot be read: {os.strerror(errno.ENOENT)}")
    raise InputError(
        f"{path}: {'is a folder; name the file in it' if path.is_dir() else 'cannot be read: is no regular file'}"
    )


def whole_text(path: Path, most: int = 0) -> str:
    """Return the text of a file of at most `most` bytes (default: LARGEST_WHOLE), bad bytes as U+FFFD.

    InputError if it cannot be read or is larger.
    """
    most = raised(most or LARGEST_WHOLE)
    check_regular(path)
    try:
        with path.open("rb") as file:
            data = file.read(most + 1)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(data) > most:
        raise InputError(f"{path}: is larger than {most:,} bytes, the most that is read whole")
    return data.decode("utf-8-sig", errors="replace")


def lines(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the lines of a file in UTF-8, or as `encoding` finds it, counted from 1, without their ends.

    What cannot be decoded becomes U+FFFD, so that one bad byte costs one line and not the file. InputError if it cannot be
    read, is no text, holds nothing, or has a line of more than LONGEST_LINE characters.
    """
    number, most = 0, raised(LONGEST_LINE)
    check_regular(path)
    try:
        with path.open(encoding=encoding(path), errors="replace") as file:
            while line := file.readline(most + 1):
                number += 1
                if len(line) > most:
                    raise InputError(f"{path}:{number}: the line is longer than {most:,} characters")
                yield number, line.rstrip("\n")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if number == 0:
        raise InputError(f"{path}: is empty")


def encoding(path: Path) -> str:
    """Return how a text is encoded, by its first line; InputError if its first bytes are those of a file that is no text."""
    with path.open("rb") as file:
        first = file.readline(FIRST)
    for begins, told in NOT_TEXT.items():
        if first.startswith(begins):
            raise InputError(f"{path}: {told}")
    if first.startswith(UTF_16):
        return "utf-16"
    try:
        getincrementaldecoder("utf-8")().decode(first)
    except UnicodeDecodeError:
        return WESTERN if first[:1].isascii() else "utf-8-sig"
    return "utf-8-sig"


def shown(text: str, most: int = 60) -> str:
    """Return a text from a file as a message shows it: quoted, and cut where it is long."""
    return repr(text) if len(text) <= most else f"{text[: most - 3]!r}..., {len(text):,} characters"
