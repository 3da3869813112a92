"""Decoders in a process of their own, on request: what breaks, hangs or fills its memory there ends a file, not the run."""

from __future__ import annotations

import json
import select
import struct
import subprocess
import sys
import weakref
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from time import monotonic
from typing import Any, final

import numpy as np
from attrs import frozen
from numpy.typing import NDArray

from vedette import InputError, fields

LONGEST = 2**29
"""Bytes of one answer; a frame of 64 million pixels in three colours of 16 bit has less."""
PIECE = 2**20
ROWS = 4096
"""Rows of a table that are asked for at a time."""


@final
@frozen
class Apart:
    """Limits of a process of its own, in which a source's files are decoded. Linux and macOS."""

    memory: int = fields.integer("MiB that decoding may take", default=1024, at_least=1)
    seconds: float = fields.quantity("s", "for which one image, frame or batch of rows may take", default=30.0, above=0)


@final
class Decoder:
    """The process: started when it is first asked, killed when an answer is late, and started anew for the next question.

    What goes wrong there is a ValueError that says so. It ends with this object.
    """

    def __init__(self, limits: Apart, library: str) -> None:
        self._limits, self._library = limits, library
        self._process: subprocess.Popen[bytes] | None = None
        self._end: Callable[[], object] = _nothing

    def ask(self, do: str, **what: Any) -> Any:
        """Return what the process answers: a number, words, or an array; ValueError if it cannot or ends."""
        self._start()
        return self._asked({"do": do, "with": what})

    def _start(self) -> None:
        if self._process is not None:
            return
        command = [sys.executable, "-m", "vedette_files.decoder_process"]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, bufsize=0)
        self._end = weakref.finalize(self, _kill, self._process)
        self._asked({"library": self._library, "memory": self._limits.memory})

    def _asked(self, question: dict[str, Any]) -> Any:
        process = self._process
        assert process is not None
        assert process.stdin is not None
        end = monotonic() + self._limits.seconds
        try:
            process.stdin.write(json.dumps(question).encode() + b"\n")
            of_head, of_array = struct.unpack(">QQ", self._bytes(16, end))
            if max(of_head, of_array) > LONGEST:
                raise _Ended("gave too much")
            head, data = json.loads(self._bytes(of_head, end)), self._bytes(of_array, end)
        except (OSError, _Ended, ValueError) as error:
            self.close()
            limits = f"within {self._limits.memory} MiB and {self._limits.seconds:g} s"
            told = error if isinstance(error, _Ended) else "ended"
            raise ValueError(f"cannot be decoded {limits}: the process that decodes it {told}") from None
        if "error" in head:
            raise ValueError(head["error"])
        return np.frombuffer(data, head["dtype"]).reshape(head["shape"]) if "shape" in head else head.get("value")

    def _bytes(self, size: int, end: float) -> bytes:
        """Read so many bytes until a time."""
        process = self._process
        assert process is not None
        assert process.stdout is not None
        data = bytearray()
        while len(data) < size:
            if not select.select([process.stdout], [], [], max(0.0, end - monotonic()))[0]:
                raise _Ended("takes longer")
            some = process.stdout.read(min(size - len(data), PIECE))
            if not some:
                raise _Ended("ended")
            data += some
        return bytes(data)

    def close(self) -> None:
        """End the process."""
        self._end()
        self._process = None


class _Ended(Exception):
    """The process gave no answer."""


@final
class ApartOpenCV:
    """What is used of OpenCV to read files, with its names, in a process of its own."""

    IMREAD_UNCHANGED, IMREAD_GRAYSCALE = -1, 0
    CAP_PROP_POS_MSEC, CAP_PROP_FRAME_WIDTH, CAP_PROP_FRAME_HEIGHT, CAP_PROP_FPS, CAP_PROP_FRAME_COUNT = 0, 3, 4, 5, 7
    error = ValueError

    def __init__(self, limits: Apart) -> None:
        self.decoder = Decoder(limits, "opencv")

    def imread(self, path: str, flags: int) -> NDArray[Any] | None:
        """Return an image; None if it cannot be read."""
        return self.decoder.ask("imread", path=str(Path(path).resolve()), flags=flags)

    def imreadmulti(self, path: str, start: int, count: int, flags: int) -> tuple[bool, Sequence[NDArray[Any]]]:
        """Return whether there is such a page, and it and those after it, as far as they are alike."""
        pages = self.decoder.ask("imreadmulti", path=str(Path(path).resolve()), start=start, count=count, flags=flags)
        return pages is not None, () if pages is None else tuple(pages)

    def VideoCapture(self, path: str) -> ApartVideo:
        """Open a video."""
        return ApartVideo(self.decoder, path)


@final
class ApartVideo:
    """What is used of OpenCV's videos. InputError where the process that decodes one ends."""

    def __init__(self, decoder: Decoder, path: str) -> None:
        self._decoder, self._path = decoder, path
        self._opened = bool(self._ask("open", path=str(Path(path).resolve())))

    def _ask(self, do: str, **what: Any) -> Any:
        try:
            return self._decoder.ask(do, **what)
        except ValueError as error:
            raise InputError(f"{self._path}: {error}") from None

    def isOpened(self) -> bool:
        """Return whether it can be read."""
        return self._opened

    def get(self, number: int) -> float:
        """Return one of its properties."""
        return float(self._ask("get", number=number))

    def grab(self) -> bool:
        """Pass over a frame; return whether there was one."""
        return bool(self._ask("grab"))

    def read(self) -> tuple[bool, NDArray[Any] | None]:
        """Return whether there is a further frame, and it."""
        image = self._ask("read")
        return image is not None, image

    def release(self) -> None:
        """Do nothing: the next video that is opened takes its place."""


@final
@frozen(eq=False)
class ApartTable:
    """A Parquet file that is decoded in a process of its own."""

    path: Path
    limits: Apart

    def __str__(self) -> str:
        return str(self.path)

    @property
    def name(self) -> str:
        """The file's name."""
        return self.path.name

    def cells(self, wanted: set[str]) -> tuple[list[str], Iterator[list[str]]]:
        """Return all titles, and the cells of each row under the `wanted` ones; InputError if it cannot be read."""
        decoder = Decoder(self.limits, "parquet")

        def ask(do: str, **what: Any) -> Any:
            try:
                return decoder.ask(do, **what)
            except ValueError as error:
                told = str(error)
                raise InputError(told if told.startswith(str(self.path)) else f"{self.path}: {told}") from None

        def rows() -> Iterator[list[str]]:
            while some := ask("rows", most=ROWS):
                yield from some
            decoder.close()

        return ask("table", path=str(self.path), wanted=sorted(wanted)), rows()


def _nothing() -> None:
    """End no process, as none was started."""


def _kill(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.wait()
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            pipe.close()
