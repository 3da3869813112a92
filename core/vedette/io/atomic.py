"""Files that are written whole or not at all."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, TextIO


@contextmanager
def whole_file(path: Path) -> Iterator[TextIO]:
    """Open a file for text, UTF-8 with line ends of Unix, that takes its name only once all is written.

    After an error or an interrupt, what was at `path` before is untouched and no other file is left.
    """
    with unfinished(path) as place, place.open("w", encoding="utf-8", newline="\n") as file:
        yield file


@contextmanager
def whole_bytes(path: Path) -> Iterator[BinaryIO]:
    """Open a file for bytes, as `whole_file` does for text."""
    with unfinished(path) as place, place.open("wb") as file:
        yield file


@contextmanager
def unfinished(path: Path) -> Iterator[Path]:
    """Give the place beside `path` where a file is written until it is whole."""
    place = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield place
        place.replace(path)
    except OSError as error:
        error.filename = error.filename or str(path)  # a full disk does not say where
        raise
    finally:
        place.unlink(missing_ok=True)
