"""The folder of a study: a manifest that states what determines its runs, and every finished chunk, whole or not at all."""

from __future__ import annotations

import json
import platform
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from attrs import frozen

from vedette import kernels
from vedette.errors import ConfigError, InputError, Problem, VedetteError
from vedette.writing import whole_file, write_arrays
from vedette_study.chunk import Chunk
from vedette_study.plan import Plan

MANIFEST, CHUNKS = "manifest.json", "chunks"


@frozen
class Store:
    """Finished chunks in a folder, by the place of their point in the grid and their own place in it."""

    folder: Path

    def read(self, point: int, k: int, runs: int) -> Chunk | None:
        """Return a finished chunk of so many runs, or None."""
        try:
            with np.load(self._path(point, k), allow_pickle=False) as file:
                figures = {name[2:]: file[name] for name in file.files if name.startswith("f_")}
                chunk = Chunk(figures, file["times"], file["sums"])
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        return chunk if all(len(values) == runs for values in figures.values()) else None

    def write(self, point: int, k: int, chunk: Chunk) -> None:
        """Write a finished chunk. VedetteError if the disk does not take it."""
        arrays = {f"f_{name}": values for name, values in chunk.figures.items()}
        with told(self.folder):
            write_arrays(self._path(point, k), {"times": chunk.times, "sums": chunk.sums} | arrays)

    def _path(self, point: int, k: int) -> Path:
        return self.folder / CHUNKS / f"{point:05d}-{k:07d}.npz"


@contextmanager
def told(folder: Path) -> Iterator[None]:
    """Report, for a disk that is full, what is kept and how to go on."""
    try:
        yield
    except OSError as error:
        reason = error.strerror or str(error)
        raise VedetteError(f"{folder}: {reason}; the finished chunks are kept, and --resume continues from them") from None


def made_by() -> dict[str, str]:
    """Return what else determines the last bits of a run."""
    found = {name: version(name) for name in ("vedette", "numpy", "scipy")}
    return found | {"python": platform.python_version(), "machine": platform.machine(), "kernels": kernels.RUNNING}


def manifest(plan: Plan) -> dict[str, Any]:
    """Return all that must be equal for chunks to be of one study."""
    return {"study": plan.hash, "seed": plan.seed, "chunk": plan.chunk, **made_by(), "table": plan.given}


def open_store(folder: Path, plan: Plan, *, resume: bool) -> Store:
    """Create or reopen the folder. ConfigError if it holds a study and `resume` is not set, or another study."""
    path, wanted = folder / MANIFEST, manifest(plan)
    if path.exists():
        if not resume:
            raise ConfigError([Problem("--out", f"{str(folder)!r} holds a study; --resume continues it")])
        _check(path, wanted)
        for left in (folder / CHUNKS).glob(".*.part"):
            left.unlink(missing_ok=True)
    with told(folder):
        (folder / CHUNKS).mkdir(parents=True, exist_ok=True)
        if not path.exists():
            with whole_file(path) as file:
                file.write(json.dumps(wanted, indent=2) + "\n")
    return Store(folder)


def kept_chunk(folder: Path) -> int | None:
    """Return the runs of a chunk of the study that a folder holds; None if it holds none that can be read."""
    try:
        there = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    size = there.get("chunk") if isinstance(there, dict) else None
    return size if isinstance(size, int) and size > 0 else None


def _check(path: Path, wanted: dict[str, Any]) -> None:
    try:
        there = json.loads(path.read_text(encoding="utf-8"))
        if not isinstance(there, dict):
            raise ValueError("no table")
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is not the manifest of a study: {error}") from None
    other = [
        Problem(f"{path}: {name}", f"must be {value!r} to go on, got {there.get(name)!r}")
        for name, value in wanted.items()
        if name != "table" and there.get(name) != value
    ]
    if other:
        raise ConfigError(other)
