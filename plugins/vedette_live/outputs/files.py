"""Standard output, and a file that is appended to."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.streams import Output
from vedette_files.input_files import user_path


@final
@frozen
class StandardOutput(Output):
    """What another program reads from us by a pipe."""

    kind: ClassVar[str] = "standard_output"

    def open(self) -> AbstractContextManager[Callable[[bytes], None]]:
        return _standard()


@final
@frozen
class FileOutput(Output):
    """A file that is appended to; one that was moved away, as logs are, is begun anew."""

    kind: ClassVar[str] = "file"

    path: str = fields.text("of the file")

    def open(self) -> AbstractContextManager[Callable[[bytes], None]]:
        return _appended(user_path(self.path))


@contextmanager
def _standard() -> Iterator[Callable[[bytes], None]]:
    def send(data: bytes) -> None:
        sys.stdout.buffer.write(data)
        sys.stdout.buffer.flush()

    yield send


@contextmanager
def _appended(path: Path) -> Iterator[Callable[[bytes], None]]:
    flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
    number = os.open(path, flags, 0o644)

    def send(data: bytes) -> None:
        nonlocal number
        try:
            same = os.path.samestat(path.stat(), os.fstat(number))
        except FileNotFoundError:
            same = False
        if not same:
            os.close(number)
            number = os.open(path, flags, 0o644)
        while data:
            data = data[os.write(number, data) :]

    try:
        yield send
    finally:
        os.close(number)
