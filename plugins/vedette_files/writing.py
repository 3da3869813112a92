"""The one door out: folders that one process writes into, and files that are written whole or not at all."""

from __future__ import annotations

import errno
import io
import os
import sys
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path
from shutil import rmtree
from signal import SIG_DFL, SIGTERM, default_int_handler, getsignal, signal
from threading import current_thread, main_thread
from typing import Any, BinaryIO, TextIO

import numpy as np

from vedette.errors import ConfigError, InputError, Problem
from vedette_files.files_read import NOTHING_READ, Inputs

LOCK, PARTS = ".lock", ".parts"
"""What a folder holds while a process writes into it, and how the name of a folder ends in which something is made."""

_PATIENCE = 0.3
"""s to wait for a lock: one that is released just now is no second run."""


def check_folder(folder: Path) -> None:
    """Raise ConfigError if results cannot be written into `folder`. It creates nothing."""
    existing = folder
    while not existing.exists() and existing != existing.parent:
        if existing.is_symlink():
            told = f"is a link to {str(existing.readlink())!r}, which is not there: make it, or delete the link"
            raise ConfigError.at("--out", f"{str(existing)!r} {told}")
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
    over, told on standard error. SIGTERM ends what is done meanwhile as Ctrl-C does.
    """
    if folder is None:
        yield
        return
    check_folder(folder)
    for name in names:
        reads.check(folder / name)
        if not name.endswith("/"):
            check_no_folder(folder / name)
    made = [path for path in (folder, *folder.parents) if not path.exists()]
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / LOCK
    left = _holder(path)
    try:
        told = f"writes into {str(folder)!r}: wait for it, or name another folder"
        with _locked(path, Problem("--out", told)), terminable():
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


@contextmanager
def folder_beside(path: Path, place: str) -> Iterator[Path]:
    """Give a hidden folder for what a file or a folder is made of, as large as it; none is left, or a killed process's.

    As `growing`: this process alone makes what is to be at `path`, and removes what a killed one left.
    """
    with growing(path, place):
        folder = path.with_name(f".{path.name}{PARTS}")
        rmtree(folder, ignore_errors=True)
        folder.mkdir()
        try:
            yield folder
        finally:
            rmtree(folder, ignore_errors=True)


def open_growing(path: Path) -> io.FileIO:
    """Open a file, new or as it is, to read it and to write at its end, unbuffered; OSError if it is a link.

    Its end is where it is at each write: one that was cut meanwhile, as logs are, gets no hole.
    """
    flags = os.O_RDWR | os.O_CREAT | os.O_APPEND | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    return io.FileIO(os.open(path, flags, 0o644), "r+b")


def is_at(path: Path, file: io.FileIO) -> bool:
    """Return whether an open file still has its name."""
    try:
        return os.path.samestat(path.stat(), os.fstat(file.fileno()))
    except FileNotFoundError:
        return False


def unused(path: Path) -> Path:
    """Return a path where no file is: this one, or with the first number from 2 that is free."""
    return next(free for i in count(1) if not (free := path.with_name(f"{path.name}{i if i > 1 else ''}")).exists())


def check_no_folder(path: Path) -> None:
    """Raise IsADirectoryError if a file cannot be written as there is a folder of its name: that is not ours to remove."""
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))


def _holder(path: Path) -> str | None:
    """Return the process that a lock names, None if there is no lock."""
    try:
        return path.read_text(encoding="utf-8")[:20]
    except (OSError, ValueError):
        return None


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


def write_text(path: Path, text: str) -> None:
    """Write a text as a file, whole or not at all."""
    with whole_file(path) as file:
        file.write(text)


def write_texts(folder: Path, texts: Mapping[str, str]) -> list[str]:
    """Write each text as the file of its name; return the names."""
    for name, text in texts.items():
        write_text(folder / name, text)
    return list(texts)


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
    place = path.with_name(f".{path.name}.part")
    if (held := _alone(place)) is None:
        place = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with naming(path):
            yield place
            place.replace(path)
    except BaseException as error:
        place.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename == str(place):
            error.filename = str(path)
        raise
    finally:
        if held is not None:
            held.close()


def _alone(place: Path) -> io.FileIO | None:
    """Open a file, empty, that no other process writes, such as what a killed one left; None where that is not known."""
    if sys.platform == "win32":
        return None
    from fcntl import LOCK_EX, LOCK_NB, flock

    try:
        file = io.FileIO(os.open(place, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666), "r+b")
    except OSError:  # whoever writes there says why that fails
        return None
    try:
        flock(file, LOCK_EX | LOCK_NB)
        if is_at(place, file):  # else another process has just given it its name
            file.truncate(0)
            return file
    except BlockingIOError:
        pass
    except OSError:  # there are no locks here
        place.unlink(missing_ok=True)
    file.close()
    return None
