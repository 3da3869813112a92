"""Standard output, and a file that is appended to."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.streams import Output
from vedette_files.input_files import user_path
from vedette_files.writing import growing, is_at, open_growing


@final
@frozen
class StandardOutput(Output):
    """What another program reads from us by a pipe."""

    kind: ClassVar[str] = "standard_output"

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        def send(data: bytes) -> None:
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()

        yield send


@final
@frozen
class FileOutput(Output):
    """A file that is appended to, by this process alone; one that was moved away, as logs are, is begun anew."""

    kind: ClassVar[str] = "file"

    path: str = fields.text("of the file")

    @contextmanager
    def open(self) -> Iterator[Callable[[bytes], None]]:
        path = user_path(self.path)
        with growing(path, "path"), ExitStack() as opened:
            file = opened.enter_context(open_growing(path))

            def send(data: bytes) -> None:
                nonlocal file
                if not is_at(path, file):
                    opened.close()
                    file = opened.enter_context(open_growing(path))
                end = file.seek(0, os.SEEK_END)
                try:
                    while data:
                        data = data[file.write(data) :]
                except OSError:
                    file.truncate(end)  # a full disk took a part of it
                    raise

            yield send
