"""The other side of `vedette_files.apart`: a process that decodes what it is asked for, within limits, and writes no file.

A question is a line of JSON on standard input. An answer is two lengths (8 bytes each), JSON, and the bytes of its array.
"""

from __future__ import annotations

import json
import os
import resource
import struct
import sys
from collections.abc import Callable, Iterator
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np

from vedette.errors import VedetteError


def main() -> None:
    """Answer until there are no more questions. The first line says the limit on memory, in MiB more than it takes now."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what a library prints is no answer
    questions = sys.stdin.buffer
    first = json.loads(questions.readline())
    try:
        library = _LIBRARIES[first["library"]]()
    except VedetteError as error:
        _answer(answers, {"error": str(error)})
        return
    _limit(int(first["memory"]) * 2**20)
    _answer(answers, {})
    state: dict[str, Any] = {}
    for line in questions:
        question = json.loads(line)
        try:
            value = _DO[question["do"]](library, state, **question.get("with", {}))
        except MemoryError:
            raise SystemExit(3) from None
        except Exception as error:  # whatever a decoder raises is said of the file
            _answer(answers, {"error": " ".join(f"{error}".split())[:500] or type(error).__name__})
            continue
        if isinstance(value, np.ndarray):
            _answer(answers, {"dtype": value.dtype.str, "shape": value.shape}, np.ascontiguousarray(value).tobytes())
        else:
            _answer(answers, {"value": value})


def _answer(answers: Any, head: dict[str, Any], data: bytes = b"") -> None:
    told = json.dumps(head).encode()
    answers.write(struct.pack(">QQ", len(told), len(data)) + told + data)
    answers.flush()


def _limit(more: int) -> None:
    """Let the process have so many bytes more than now, and no file to write to."""
    pages = int(Path("/proc/self/statm").read_text().split()[0]) if Path("/proc/self/statm").exists() else 0
    ceiling = pages * resource.getpagesize() + more
    resource.setrlimit(resource.RLIMIT_AS, (ceiling, ceiling))
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, 0))


def _opencv() -> Any:
    from vedette_files.libraries import needed

    cv2 = needed("cv2", "reading images needs OpenCV", "vision")
    cv2.setNumThreads(1)
    return cv2


def _parquet() -> Any:
    from vedette_files.tables.columnar import pyarrow

    pyarrow()
    return None


def _open(cv2: Any, state: dict[str, Any], path: str) -> bool:
    state["video"] = cv2.VideoCapture(path)
    return bool(state["video"].isOpened())


def _pages(cv2: Any, state: dict[str, Any], path: str, start: int, count: int, flags: int) -> Any:
    """Return pages of a file, as far as they are alike; None if the first cannot be read."""
    pages = cv2.imreadmulti(path, start, count, flags=flags)[1]
    alike = list(takewhile(lambda page: (page.shape, page.dtype) == (pages[0].shape, pages[0].dtype), pages))
    return np.stack(alike) if alike else None


def _table(library: Any, state: dict[str, Any], path: str, wanted: list[str]) -> list[str]:
    from vedette_files.tables.columnar import parquet_cells

    titles, state["rows"] = parquet_cells(Path(path), set(wanted))
    return titles


def _rows(library: Any, state: dict[str, Any], most: int) -> list[list[str]]:
    rows: Iterator[list[str]] = state["rows"]
    return [row for _, row in zip(range(most), rows, strict=False)]


_LIBRARIES: dict[str, Callable[[], Any]] = {"opencv": _opencv, "parquet": _parquet}
_DO: dict[str, Callable[..., Any]] = {
    "imread": lambda cv2, state, path, flags: cv2.imread(path, flags),
    "imreadmulti": _pages,
    "open": _open,
    "get": lambda cv2, state, number: float(state["video"].get(number)),
    "grab": lambda cv2, state: bool(state["video"].grab()),
    "read": lambda cv2, state: state["video"].read()[1],
    "table": _table,
    "rows": _rows,
}

if __name__ == "__main__":
    main()
