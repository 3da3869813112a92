"""The one door out: folders that one process writes into, and files that are written whole or not at all."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree
from signal import SIG_DFL, SIGTERM, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from typing import Any, BinaryIO, TextIO, final
from uuid import uuid4

import numpy as np

from vedette.errors import ConfigError, InputError, Problem
from vedette_files.files_read import NOTHING_READ, Inputs

LOCK, UNFINISHED, WHOLE, BEGUN = ".lock", ".run-", ".whole", "config.json"
"""What a folder of results holds while a process writes into it: the lock, and the run's place, named so and by a number.

The place holds the third of these while its files move to the folder: whoever comes next moves the rest. At first it holds
the last alone, which shows nothing, and from which nobody can go on.
"""

_PATIENCE = 0.3
"""s to wait for a lock: one that is released just now is no second run."""

_FULL = (errno.ENOSPC, errno.EFBIG)
"""Errors of a disk that is full, or of a limit on files: they do not say where."""


def check_folder(folder: Path) -> None:
    """Raise ConfigError if results cannot be written into `folder`. It creates nothing."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        existing = existing.parent
    if not existing.is_dir():
        raise ConfigError.at("--out", f"{str(existing)!r} is a file, and results need a folder")
    if not os.access(existing, os.W_OK | os.X_OK):
        raise ConfigError.at("--out", f"the folder {str(existing)!r} cannot be written to")


@contextmanager
def locked(folder: Path | None, reads: Inputs = NOTHING_READ, names: Iterable[str] = ()) -> Iterator[None]:
    """Hold a folder of results for this process alone, and make it if need be; a linked folder is followed. None: none.

    ConfigError if another process holds it, if it cannot be written to, or if one of the files `names` in it is read or a
    link; IsADirectoryError if one is a folder and its name does not end with /. A lock that a killed process left is taken
    over, told on standard error.
    """
    if folder is None:
        yield
        return
    check_folder(folder)
    for name in names:
        reads.check(folder / name)
        if not name.endswith("/"):
            _check_no_folder(folder / name)
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK
    left = _holder(path)
    try:
        with _locked(path, Problem("--out", f"writes into {str(folder)!r}: wait for it, or name another folder")):
            if left is not None:
                print(f"vedette: {folder}: the lock of a process{left} that has ended is taken over", file=sys.stderr)
            yield
    finally:
        for parent in made:
            with suppress(OSError):  # it holds something
                parent.rmdir()


@contextmanager
def _locked(path: Path, refusal: Problem) -> Iterator[None]:
    """Hold a lock, in which our number stands; ConfigError that another process, whose number is told, does what is said."""
    from filelock import FileLock, Timeout

    try:
        held = FileLock(path).acquire(timeout=_PATIENCE)
    except Timeout:
        told = f"another process{_holder(path) or ''} {refusal.text}"
        raise ConfigError.at(refusal.place, told) from None
    with held:
        try:
            with naming(path.parent):
                path.write_text(f" {os.getpid()}", encoding="utf-8")
            yield
        finally:
            path.unlink(missing_ok=True)  # while it is held: whoever waits for it looks whether it is still there


@contextmanager
def growing(path: Path, place: str) -> Iterator[None]:
    """Hold a file that grows, as a log or a database, for this process alone.

    ConfigError with its place in the config if another process holds it, if it is a link, or if its folder is not there.
    """
    NOTHING_READ.check(path, place)
    if not path.absolute().parent.is_dir():
        raise ConfigError.at(place, f"must be a file in a folder that exists, got {str(path)!r}")
    with _locked(path.with_name(f".{path.name}{LOCK}"), Problem(place, f"writes to {str(path)!r}: name another file")):
        yield


def open_growing(path: Path) -> io.FileIO:
    """Open a file, new or as it is, to read it and to write at its end, unbuffered; OSError if it is a link."""
    flags = os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    return io.FileIO(os.open(path, flags, 0o644), "r+b")


def is_at(path: Path, file: io.FileIO) -> bool:
    """Return whether an open file still has its name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def _check_no_folder(path: Path) -> None:
    """Raise IsADirectoryError if a file cannot be written as there is a folder of its name: that is not ours to remove."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))


def _holder(path: Path) -> str | None:
    """Return the process that a lock names, None if there is no lock."""
    try:
        return path.read_text(encoding="utf-8")[:20]
    except (OSError, ValueError):
        return None


@final
class Results:
    """What one run writes into a folder: in a part of its own, `place`, until it is complete."""

    def __init__(self, folder: Path, reads: Inputs, replaces: Sequence[Path] = ()) -> None:
        self.folder, self._reads, self._replaces = folder, reads, replaces
        self.place = folder / f"{UNFINISHED}{uuid4().hex[:8]}"
        self.keep = False

    def adopt(self) -> None:
        """Move all files to the folder, each in place of the former one of its name; first see that all can.

        Then nothing is left of the runs that this one replaces. Files whose names begin with a dot are the run's own.
        """
        for path in _to_move(self.place):
            self._reads.check(self.folder / path.name)
            if not path.is_dir():
                _check_no_folder(self.folder / path.name)
            elif (target := self.folder / path.name).is_file():
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(target))
        (self.place / WHOLE).touch()
        _move(self.place)
        for former in self._replaces:
            rmtree(former, ignore_errors=True)


def _to_move(place: Path) -> list[Path]:
    return [path for path in sorted(place.iterdir()) if not path.name.startswith(".")]


def _move(place: Path) -> None:
    for path in _to_move(place):
        target = place.parent / path.name
        if target.is_dir():
            target.replace(place / f".{path.name}.former")
        path.replace(target)
    for rest in place.iterdir():
        if rest.name != WHOLE:
            rmtree(rest) if rest.is_dir() else rest.unlink()
    (place / WHOLE).unlink()  # last: without it the run would seem to be one that did not end
    place.rmdir()


def settle(folder: Path) -> bool:
    """Move the rest of what runs left that were killed while their files moved; return whether there was any.

    This process must hold the folder.
    """
    left = [place for place in unfinished_runs(folder) if (place / WHOLE).exists()]
    for place in left:
        _move(place)
    for place in folder.glob(f"{UNFINISHED}*"):
        with suppress(OSError):  # it holds something
            place.rmdir()
    return bool(left)


@contextmanager
def results_in(
    folder: Path, reads: Inputs = NOTHING_READ, names: Iterable[str] = (), replaces: Sequence[Path] = ()
) -> Iterator[Results]:
    """Let a run write into `folder`: what is there stays as it is until the run has ended, and all its files are whole.

    As `locked`. The run writes into `Results.place`, whose files move into the folder in the end. A run that fails leaves
    nothing, or its place if it says by `keep` that there is something to see; one that is killed leaves it. `replaces`: the
    places of unfinished runs that it goes on from; nothing of them is left once it has ended.
    """
    with locked(folder, reads, names):
        settle(folder)
        for left in unfinished_runs(folder):
            if [path.name for path in left.iterdir()] == [BEGUN]:
                rmtree(left, ignore_errors=True)  # it was killed while it kept all in memory
            elif left not in replaces:
                told = "`vedette report` shows it, `vedette run --resume` goes on from it"
                print(f"vedette: {folder}: holds an unfinished run, {left.name}: {told}", file=sys.stderr)
        results = Results(folder, reads, replaces)
        results.place.mkdir()
        try:
            yield results
            results.adopt()
        except OSError as error:
            stays = f"{error.strerror or error}; what was there before stays"
            if results.place.is_dir() and results.keep:
                kept = f"{stays}, and what this run wrote is in {results.place.name}"
                raise OSError(error.errno, kept, str(folder)) from None
            if error.errno in _FULL:
                raise OSError(error.errno, stays, str(folder)) from None
            raise
        finally:
            if not results.keep:
                rmtree(results.place, ignore_errors=True)


def unfinished_runs(folder: Path) -> list[Path]:
    """Return the places in a folder where runs wrote that did not come to their end, the latest last."""
    try:
        left = [path for path in folder.glob(f"{UNFINISHED}*") if path.is_dir() and any(path.iterdir())]
        return sorted(left, key=lambda path: path.stat().st_mtime)
    except OSError:
        return []


@contextmanager
def terminable() -> Iterator[None]:
    """Let SIGTERM end what is within as Ctrl-C does: by an exception, after which nothing half done is on the disk."""
    if current_thread() is not main_thread() or getsignal(SIGTERM) is not SIG_DFL:
        yield
        return
    signal(SIGTERM, default_int_handler)
    try:
        yield
    finally:
        signal(SIGTERM, SIG_DFL)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Let an error say what was being written, if it does not: a full disk does not say where."""
    try:
        yield
    except OSError as error:
        error.filename = error.filename or str(path)
        raise


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
    """Give the place beside `path` where a file is written until it is whole. InputError if `path` is a link."""
    if path.is_symlink():
        raise InputError(f"{path}: is a link, and files are not written through links: delete it, or name another file")
    place = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with naming(path):
            yield place
            place.replace(path)
    finally:
        place.unlink(missing_ok=True)
