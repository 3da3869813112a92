"""Folders of results: a run writes into a part of its own, and takes the place of the run before it once it is whole."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree
from typing import final
from uuid import uuid4

from vedette_files.files_read import NOTHING_READ, Inputs
from vedette_files.writing import check_no_folder, locked

UNFINISHED, WHOLE, CHECKPOINT = ".run-", ".whole", ".checkpoint.json"
"""The place of a run that writes into a folder is named by the first of these and a number.

It holds the second while its files move to the folder: whoever comes next moves the rest. It holds the third if somebody can
go on from it.
"""

_GONE = ".gone"
"""How names end that say, in such a place, which files of the folder no longer are: those of the former run alone."""

_FULL = (errno.ENOSPC, errno.EFBIG)
"""Errors of a disk that is full, or of a limit on files: they do not say where."""


@final
class Results:
    """What one run writes into a folder: in a part of its own, `place`, until it is complete."""

    def __init__(self, folder: Path, reads: Inputs, names: Iterable[str] = (), replaces: Sequence[Path] = ()) -> None:
        self.folder, self._reads, self._names, self._replaces = folder, reads, tuple(names), replaces
        self.place = folder / f"{UNFINISHED}{uuid4().hex[:8]}"
        self.keep = False

    def adopt(self) -> None:
        """Move all files to the folder, each in place of the former one of its name; first see that all can.

        Then nothing is left of the run before, nor of those that this one replaces: smoothed tracks or a page of another run
        would be taken for those of this one. Files whose names begin with a dot are the run's own.
        """
        for path in _to_move(self.place):
            self._reads.check(self.folder / path.name)
            if not path.is_dir():
                check_no_folder(self.folder / path.name)
            elif (target := self.folder / path.name).is_file():
                raise NotADirectoryError(errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(target))
        for name in self._names:
            if (self.folder / name).is_file() and not (self.place / name).exists():
                (self.place / f".{name}{_GONE}").touch()
        (self.place / WHOLE).touch()
        _move(self.place)
        for former in self._replaces:
            rmtree(former, ignore_errors=True)


def _to_move(place: Path) -> list[Path]:
    return [path for path in sorted(place.iterdir()) if not path.name.startswith(".")]


def _move(place: Path) -> None:
    for mark in place.glob(f".*{_GONE}"):
        (place.parent / mark.name[1 : -len(_GONE)]).unlink(missing_ok=True)
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


def finished(folder: Path) -> Path:
    """Return a folder that is read: the files of a run that was killed while they moved are in their places by then.

    ConfigError if they move just now, or cannot be moved.
    """
    if any((place / WHOLE).exists() for place in unfinished_runs(folder)):
        with locked(folder):
            settle(folder)
    return folder


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

    As `locked`. The run writes into `Results.place`, whose files move into the folder in the end; those of `names` that it
    does not write go with the run before. A run that fails leaves nothing, or its place if it says by `keep` that there is
    something to see; one that is killed leaves it, and the next removes it if nobody can go on from it. `replaces`: the
    places of unfinished runs that it goes on from; nothing of them is left once it has ended.
    """
    names = tuple(names)
    with locked(folder, reads, names):
        settle(folder)
        for left in unfinished_runs(folder):
            if not (left / CHECKPOINT).exists():
                rmtree(left, ignore_errors=True)  # it kept all in memory, or had not begun
            elif left not in replaces:
                told = "`vedette report` shows it, `vedette run --resume` goes on from it"
                print(f"vedette: {folder}: holds an unfinished run, {left.name}: {told}", file=sys.stderr)
        results = Results(folder, reads, names, replaces)
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
