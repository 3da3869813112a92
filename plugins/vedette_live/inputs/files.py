"""Standard input, and files that grow."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Generator, Iterator
from pathlib import Path
from threading import Event
from typing import Any, BinaryIO, ClassVar, final

from attrs import frozen

from vedette import fields
from vedette.errors import InputError
from vedette.streams import Arrival, Input, now
from vedette_files.input_files import check_regular, user_path
from vedette_live.addresses import PATIENCE
from vedette_live.log import LOG

PIECE = 2**16
"""Bytes that are read at once."""
SAME = 256
"""Bytes before a place that must be what they were for a file to be the same: some lines, which tell of times."""


@final
@frozen
class StandardInput(Input):
    """What another program writes to us by a pipe. Its end is the end of this input."""

    kind: ClassVar[str] = "standard_input"

    def listen(self, stop: Event) -> Iterator[Arrival]:
        if sys.stdin is None:
            raise InputError("standard input is closed: let another program write to it, or name a file")
        number = sys.stdin.fileno()
        while not stop.is_set():
            ready, _, _ = select.select([number], [], [], PATIENCE)
            if not ready:
                continue
            data = os.read(number, PIECE)
            yield Arrival(data, now(), "standard input", ended=not data)
            if not data:
                return


@final
@frozen
class FileInput(Input):
    """A file that another program appends to. One that becomes shorter, or is replaced, is read from its beginning.

    After a restart it is read on from where it was, if it holds there what it held.
    """

    kind: ClassVar[str] = "file"

    path: str = fields.text("of the file")
    from_end: bool = fields.flag("leave out what it holds at the first start", default=False)
    follow: bool = fields.flag("wait for what is appended; otherwise its end is the end of this input", default=True)
    every: float = fields.quantity("s", "time between looks at the file", default=0.2, above=0)

    def listen(self, stop: Event) -> Iterator[Arrival]:
        return self.go_on(stop, None)

    def go_on(self, stop: Event, place: Any) -> Iterator[Arrival]:
        path, count, unwell = user_path(self.path), 0, ""
        if not self.follow or self.from_end:
            check_regular(path)
        while not stop.is_set():
            try:
                with path.open("rb") as file:
                    before = b"" if count else (yield from self._begun(file, path.name, place))
                    count += 1
                    if unwell:
                        unwell = ""
                        yield Arrival(b"", now(), path.name)
                    yield from self._lines(file, path, before, stop, f"{path.name} #{count}")
                if not self.follow:
                    return
            except OSError as error:
                if not self.follow:
                    raise InputError(f"{path}: cannot be read: {error.strerror}") from None
                if unwell != (told := f"{path}: cannot be read: {error.strerror}"):
                    unwell = told
                    yield Arrival(b"", now(), path.name, unwell=unwell)
                stop.wait(self.every)

    def _begun(self, file: BinaryIO, name: str, place: Any) -> Generator[Arrival, None, bytes]:
        """Go to where the first file is read from, and return what it holds before; tell where a place is lost."""
        if place is not None and (found := _found(file, *place)) is not None:
            return found
        if place is not None:
            why = f"what the former file got after byte {place[0]} is not read"
            LOG.warning("another file than before", extra={"file": name, "why": why})
            yield Arrival(b"", now(), name, ended=True)
        elif self.from_end:
            file.seek(max(0, file.seek(0, os.SEEK_END) - SAME))
            return file.read()
        return b""

    def _lines(self, file: BinaryIO, path: Path, before: bytes, stop: Event, name: str) -> Iterator[Arrival]:
        """Yield what a file holds and gets, with places between lines, until it ends or is replaced."""
        first = os.fstat(file.fileno())
        while not stop.is_set():
            data = file.read(PIECE)
            if whole := data.rfind(b"\n") + 1:  # so that there is a place without a part of a line before it
                file.seek(whole - len(data), os.SEEK_CUR)
                data = data[:whole]
            if data:
                if not before:
                    yield Arrival(b"", now(), name, place=_place(file.tell() - len(data), data))
                before = (before + data)[-SAME:]
                yield Arrival(data, now(), name, place=_place(file.tell(), before))
            elif not self.follow or _replaced(path, first, file.tell()):
                yield Arrival(b"", now(), name, ended=True)
                return
            else:
                stop.wait(self.every)


def _place(at: int, held: bytes) -> tuple[int, str]:
    """Return a place of a file, and what it holds before, or at its beginning after it."""
    return at, held[:SAME].hex()


def _found(file: BinaryIO, at: int, held: str) -> bytes | None:
    """Go to a place of a file, and return what it holds before; to its beginning, and None, if that is not what it held."""
    begin, wanted = file.seek(max(0, at - SAME)), bytes.fromhex(held)
    same = file.read(len(wanted)) == wanted
    file.seek(at if same else 0)
    return wanted[: at - begin] if same else None


def _replaced(path: Path, first: os.stat_result, at: int) -> bool:
    """Return whether the file that we read is no longer the one of this name, or was cut."""
    try:
        there = path.stat()
    except OSError:
        return True
    return not os.path.samestat(there, first) or there.st_size < at
