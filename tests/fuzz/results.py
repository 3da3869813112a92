"""Results that are read back, with bytes changed, cut or put in: series, tables, chunks, tracks, frames; and config text."""

from __future__ import annotations

import io
import json
import zipfile
from contextlib import suppress
from functools import cache
from pathlib import Path

import numpy as np

from fuzz.cases import pick
from vedette.config.files import read_file
from vedette_files import read_series, read_tracks
from vedette_files.archives import open_arrays
from vedette_files.json_values import read_table
from vedette_files.jsonl.frames import read_frame
from vedette_files.series import SeriesFile
from vedette_study.store import Store

YAML = b"a: &a {x: 1, y: [2, 3]}\nb:\n  <<: *a\n  z: !!float 1e3\nc: 2020-01-02\nd: 'text'\n"
TOML = b'a = 1\n[b.c]\nd = [1.5, "x"]\ne = 2020-01-02T03:04:05Z\n[[f]]\ng = true\n'
TABLE = json.dumps({"runs": 3, "interrupted": False, "deep": {"a": [[1, 2], {"b": None}]}, "text": "\u00e9"}).encode()
ROW = {"track": 0, "time": 1.0, "mean": [1.0], "cov": [[2.0]], "confirmed": True, "existence": 1.0, "hit": 1.0, "nis": 0.5}
LINES = [
    {"format": "vedette tracks", "version": 1, "axes": {"x": "m"}},
    ROW | {"weights": [0, 1]},
    {"track": 0, "time": 2.0, "merged_into": 1},
]
TRACKS = "\n".join(map(json.dumps, LINES)).encode()
GLUE = [b"!!int ", b"<<: *a", b"&a ", b"[" * 40, b"\x00", b"\xff", b"9" * 400, b"{", b": ", b"\n", b"!!binary ", b".", b"- "]


@cache
def _series() -> bytes:
    target = io.BytesIO()
    file = SeriesFile(target, {"notes": {}})
    file.add({"entries": {"time": np.arange(50.0), "hit": np.arange(50) > 3}})
    file.flush()
    return target.getvalue()


@cache
def _arrays() -> bytes:
    target = io.BytesIO()
    np.savez_compressed(target, times=np.arange(4.0), sums=np.zeros((3, 5, 4)), f_nees=np.ones(6), pixels=np.eye(9))
    return target.getvalue()


def changed(rng: np.random.Generator, data: bytes) -> bytes:
    """Return the bytes with a few changes."""
    made = bytearray(data)
    for _ in range(int(rng.integers(1, 5))):
        at = int(rng.integers(0, len(made) + 1))
        how = int(rng.integers(5))
        if how == 0:
            made[at:] = b""
        elif how == 1 and at < len(made):
            made[at] = int(rng.integers(256))
        elif how == 2:
            made[at:at] = pick(rng, GLUE)
        elif how == 3:
            made[at : at + int(rng.integers(1, 9))] = b""
        elif at + 4 <= len(made):
            made[at : at + 4] = pick(rng, [b"\xff\xff\xff\xff", b"\x00\x00\x00\x00", b"\xff\xff\xff\x7f"])
    return bytes(made)


def _header(rng: np.random.Generator) -> bytes:
    """Return an archive of an array whose header was changed, with a right checksum."""
    content = io.BytesIO()
    np.lib.format.write_array(content, np.arange(5.0))
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as file:
        for name in ("times", "sums", "f_nees", "pixels", "about.json"):
            data = content.getvalue()
            file.writestr(name if "." in name else f"{name}.npy", changed(rng, data[:128]) + data[128:])
    return archive.getvalue()


def _chunk(path: Path) -> None:
    place = path.parent / "chunks" / "00000-0000000.npz"
    place.parent.mkdir(exist_ok=True)
    place.write_bytes(path.read_bytes())
    Store(path.parent).read(0, 0, 6)


def _frame(path: Path) -> None:
    with suppress(ValueError):  # the line of a recording that names it is refused by it
        read_frame({"file": path.name}, path.parent)


def _whole(path: Path) -> None:
    with open_arrays(path) as arrays:
        for name in arrays.names:
            arrays[name]


READ = {
    "series.npz": (_series, read_series),
    "arrays.npz": (_arrays, _whole),
    "chunk.npz": (_arrays, _chunk),
    "frame.npz": (_arrays, _frame),
    "summary.json": (lambda: TABLE, read_table),
    "config.json": (lambda: TABLE, read_file),
    "config.yaml": (lambda: YAML, read_file),
    "config.toml": (lambda: TOML, read_file),
    "tracks.jsonl": (lambda: TRACKS, read_tracks),
}


def case(rng: np.random.Generator, folder: Path) -> str:
    """Change the bytes of one file, and read it."""
    name = pick(rng, list(READ))
    make, read = READ[name]
    data = _header(rng) if name.endswith("npz") and rng.random() < 0.3 else changed(rng, make())
    path = folder / name
    path.write_bytes(data)
    read(path)
    return "read"
