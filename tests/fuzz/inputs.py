"""Inputs of every source: small good ones with changes. Reading them refuses, or accounts for every row."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np

from fuzz.cases import NASTY, pick
from fuzz.readers import READERS
from fuzz.samples import FILES
from fuzz.trees import mutated

ODD = [b"\0", b"\xff", b"\r", b"\n", b'"', b",", b"\xef\xbb\xbf", b"\x1c", b"\xe2\x80\xa8"]
CELLS = [value for value in NASTY if isinstance(value, str)] + ["1e15", "-0.0", "1e400", "7" * 140_000, "1.5e", "0"]

Rng = np.random.Generator


def case(rng: Rng, folder: Path) -> str:
    """Write the files of one input with changes and read them."""
    name = pick(rng, sorted(READERS))
    here = folder / "input"
    shutil.rmtree(here, ignore_errors=True)
    here.mkdir(parents=True)
    files = dict(FILES[name]())
    changed = pick(rng, sorted(files))
    files[changed] = spoilt(rng, files[changed])
    for file, data in files.items():
        (here / file).parent.mkdir(exist_ok=True)
        (here / file).write_bytes(data)
    READERS[name](here, files, bool(rng.random() < 0.5))
    return f"accepted by {name}"


def spoilt(rng: Rng, data: bytes) -> bytes:
    """Return the bytes of a file with changes: of bytes, of lines, of cells, or of what its JSON says."""
    for _ in range(int(rng.integers(1, 3))):
        data = pick(rng, [_bytes, _bytes, _lines, _lines, _cells, _cells, _cells, _json, _json])(rng, data)
    return data


def _bytes(rng: Rng, data: bytes) -> bytes:
    if not data:
        return b"\n"
    at, change = int(rng.integers(len(data))), int(rng.integers(5))
    if change == 0:
        return data[:at]
    if change == 1:
        return data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
    if change == 2:
        return data[:at] + pick(rng, ODD) + data[at:]
    if change == 3:
        end = int(rng.integers(at, min(at + 40, len(data)) + 1))
        return data[:at] + data[end:]
    return data[:at] + data[at : at + 30] * 2 + data[at:]


def _lines(rng: Rng, data: bytes) -> bytes:
    lines = data.split(b"\n")
    change = int(rng.integers(6))
    at = int(rng.integers(len(lines)))
    if change == 5:  # nothing but blank lines, from somewhere on
        lines[pick(rng, [0, at]) :] = [pick(rng, [b"", b" ", b"\r", b"\t "])] * int(rng.integers(1, 5))
    elif change == 0:
        del lines[at]
    elif change == 1:
        lines.insert(at, lines[int(rng.integers(len(lines)))])
    elif change == 2:
        head, rest = lines[:1], lines[1:]
        lines = head + [rest[i] for i in rng.permutation(len(rest)).tolist()]
    elif change == 3:
        lines[at] = b"" if rng.random() < 0.5 else b"[" * 100_000
    else:
        return b"\r\n".join(lines)
    return b"\n".join(lines)


def _cells(rng: Rng, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = int(rng.integers(len(lines)))
    cells = lines[at].split(b",")
    cells[int(rng.integers(len(cells)))] = pick(rng, CELLS).encode("utf-8", "surrogatepass")
    lines[at] = b",".join(cells)
    return b"\n".join(lines)


def _json(rng: Rng, data: bytes) -> bytes:
    """Return a file with a change in the JSON of all of it or of a line."""
    whole = data.lstrip().startswith(b"[") or data.count(b"\n") == 0
    lines = [data] if whole else data.split(b"\n")
    at = int(rng.integers(len(lines)))
    try:
        tree = json.loads(lines[at])
        lines[at] = json.dumps(mutated(rng, tree, [tree])).encode()
    except (ValueError, TypeError, RecursionError):
        return _bytes(rng, data)
    return b"\n".join(lines)
