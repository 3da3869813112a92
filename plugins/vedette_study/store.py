"""The folder of a study: a manifest that states what determines its runs, and every finished chunk, whole or not at all."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from attrs import frozen

from vedette import ConfigError, InputError, Problem, VedetteError, kernels
from vedette_files.archives import open_arrays
from vedette_files.files_read import contents
from vedette_files.json_values import read_table
from vedette_files.writing import write_arrays, write_text
from vedette_report.identity import Code, check, tell
from vedette_study.chunk import Chunk
from vedette_study.plan import Plan

MANIFEST, CHUNKS = "manifest.json", "chunks"


@frozen
class Store:
    """Finished chunks in a folder, by the place of their point in the grid and their own place in it."""

    folder: Path
    code: Code | None = None

    def read(self, point: int, k: int, runs: int) -> Chunk | None:
        """Return a finished chunk of so many runs; None if there is none, or it is of other code."""
        try:
            with open_arrays(self._path(point, k)) as file:
                figures = {name[2:]: file[name] for name in file.names if name.startswith("f_")}
                chunk = Chunk(figures, file["times"], file["sums"], str(file["made"]) if "made" in file else "")
        except InputError:
            return None
        if self.code is not None and not self.code.accept and chunk.made != self.code.name:
            return None
        whole = chunk.times.ndim == 1 and chunk.sums.shape == (3, 5, len(chunk.times)) and bool(figures)
        numbers = all(values.dtype.kind == "f" for values in (chunk.times, chunk.sums, *figures.values()))
        return chunk if whole and numbers and all(values.shape == (runs,) for values in figures.values()) else None

    def write(self, point: int, k: int, chunk: Chunk) -> None:
        """Write a finished chunk. VedetteError if the disk does not take it."""
        arrays = {f"f_{name}": values for name, values in chunk.figures.items()}
        with told(self.folder):
            write_arrays(self._path(point, k), {"times": chunk.times, "sums": chunk.sums, "made": chunk.made} | arrays)

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
    versions = {name: version(name) for name in ("vedette", "numpy", "scipy")}
    return versions | {"python": platform.python_version(), "machine": platform.machine(), "kernels": kernels.RUNNING}


def manifest(plan: Plan, code: Code) -> dict[str, Any]:
    """Return all that must be equal for chunks to be of one study."""
    same = {"study": plan.hash, "seed": plan.seed, "chunk": plan.chunk, "vedette": version("vedette")}
    same |= {"data": contents([point.config for point in plan.points])}
    return same | {"code": dict(code.made), "table": plan.given}


def open_store(folder: Path, plan: Plan, code: Code, *, resume: bool) -> Store:
    """Create or reopen the folder. ConfigError if it holds a study and `resume` is not set, or another study.

    One of other code is refused, too, unless `code` accepts it: then its manifest states both.
    """
    path, wanted = folder / MANIFEST, manifest(plan, code)
    if path.exists():
        if not resume:
            raise ConfigError.at("--out", f"{str(folder)!r} holds a study; --resume continues it")
        there = _checked(path, wanted)
        own = there.get("code")
        texts = check(own if isinstance(own, dict) else {}, code.made, str(path), accept=code.accept)
        tell(texts)
        if texts and code.accept and code.made not in (others := list(there.get("also", []))):
            with told(folder):
                write_text(path, json.dumps(there | {"also": [*others, dict(code.made)]}, indent=2) + "\n")
        for left in (folder / CHUNKS).glob(".*.part"):
            left.unlink(missing_ok=True)
    with told(folder):
        (folder / CHUNKS).mkdir(parents=True, exist_ok=True)
        if not path.exists():
            write_text(path, json.dumps(wanted, indent=2) + "\n")
    return Store(folder, code)


def kept_chunk(folder: Path) -> int | None:
    """Return the runs of a chunk of the study that a folder holds; None if it holds none that can be read."""
    try:
        size = read_table(folder / MANIFEST).get("chunk")
    except InputError:
        return None
    return size if isinstance(size, int) and size > 0 else None


def _checked(path: Path, wanted: dict[str, Any]) -> dict[str, Any]:
    there = read_table(path)
    other = [
        Problem(f"{path}: {name}", f"must be {value!r} to go on, got {there.get(name)!r}")
        for name, value in wanted.items()
        if name not in ("table", "code") and there.get(name) != value
    ]
    if other:
        raise ConfigError(other)
    return there
