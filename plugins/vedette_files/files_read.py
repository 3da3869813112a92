"""The files that a command reads: none of them is written over, and what they hold is known again."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from hashlib import file_digest, sha256
from pathlib import Path
from typing import Any, final

from attrs import frozen

from vedette.errors import ConfigError


@final
@frozen(eq=False)
class Inputs:
    """The files that a command reads, by device and number, each as the user knows it."""

    names: Mapping[tuple[int, int], str]

    @classmethod
    def of(cls, *given: Any) -> Inputs:
        """Find the files that texts and paths name, also inside lists and the tables of a config.

        A table's `path` may be a folder: then its files count, and those that other texts of the table name in it.
        """
        names: dict[tuple[int, int], str] = {}
        for path, in_full in _paths(given):
            with suppress(OSError, ValueError, RuntimeError):  # a text that is no path
                known = path.expanduser()
                if known.is_file():
                    status = known.stat()
                    names.setdefault((status.st_dev, status.st_ino), str(path))
                elif in_full and known.is_dir():  # by their numbers in the folder: one of frames holds very many
                    device = known.stat().st_dev
                    with os.scandir(known) as entries:
                        names |= {(device, entry.inode()): entry.path for entry in entries if not entry.is_symlink()}
        return cls(names)

    def check(self, path: Path, option: str = "--out") -> None:
        """Raise ConfigError if `path` is a file that is read, or a link: what it points to is not ours to write."""
        if path.is_symlink():
            raise ConfigError.at(option, f"{str(path)!r} is a link, and results are not written through links")
        number = _number(path)
        if number is not None and number in self.names:
            told = f"{str(path)!r} would be written, and is read: it is {self.names[number]!r}; name another place"
            raise ConfigError.at(option, told)


NOTHING_READ = Inputs({})


def contents(*given: Any) -> str:
    """Return a hash of the bytes of the files that texts and paths name, as `Inputs.of` finds them."""
    total = sha256()
    for path, in_full in sorted(set(_paths(given))):
        with suppress(OSError, ValueError, RuntimeError):
            known = path.expanduser()
            for each in sorted(known.iterdir()) if in_full and known.is_dir() else [known]:
                if each.is_file():
                    with each.open("rb") as file:
                        total.update(file_digest(file, "sha256").digest())
    return total.hexdigest()[:16]


def _paths(given: Any, folder: Path | None = None) -> Iterator[tuple[Path, bool]]:
    """Yield the paths that may be meant, and whether a folder means all that is in it."""
    if isinstance(given, Path):
        yield given, True
    elif isinstance(given, str):
        if given:
            yield Path(given), False
            if folder is not None:
                yield folder / given, False
    elif isinstance(given, Mapping):
        at = given.get("path")
        if isinstance(at, str) and at:
            folder = Path(at)
            yield folder, True
        for value in given.values():
            yield from _paths(value, folder)
    elif isinstance(given, Iterable):
        for value in given:
            yield from _paths(value, folder)


def _number(path: Path) -> tuple[int, int] | None:
    """Return device and number of the file that a path leads to; None if there is none."""
    try:
        status = path.stat()
    except OSError:
        return None
    return status.st_dev, status.st_ino
