"""Folders that can be written to, and files that are written whole or not at all."""

from __future__ import annotations

import io
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np

from vedette.errors import ConfigError, Problem


def check_folder(folder: Path) -> None:
    """Raise ConfigError if results cannot be written into `folder`. It creates nothing."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise ConfigError([Problem("--out", f"{str(existing)!r} is a file, and results need a folder")])
    if not os.access(existing, os.W_OK | os.X_OK):
        raise ConfigError([Problem("--out", f"the folder {str(existing)!r} cannot be written to")])


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


def write_arrays(path: Path, arrays: Mapping[str, Any], *, compressed: bool = False) -> None:
    """Write arrays by name, as numpy's `.npz`."""
    content = io.BytesIO()  # older numpy leaves the archive open on a full disk, and closing it prints a traceback
    (np.savez_compressed if compressed else np.savez)(content, **arrays)
    with whole_bytes(path) as file:
        file.write(content.getbuffer())


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
