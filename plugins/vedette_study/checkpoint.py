"""Finished parts of a long reproduction in its folder, so that `--resume` goes on with them."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from shutil import rmtree
from typing import Any, TypeVar

import attrs

from vedette.errors import ConfigError, InputError
from vedette_files.archives import open_arrays
from vedette_files.json_values import read_table
from vedette_files.writing import write_arrays, write_text

R = TypeVar("R")
FOLDER, ABOUT = "parts", "study.json"


class Parts:
    """Keeps the parts of one study, which `about` tells from any other, below a folder: a `Keep`."""

    def __init__(self, folder: Path, about: Mapping[str, Any], *, resume: bool) -> None:
        self._folder = folder / FOLDER
        self._about = dict(about)
        before = self._before()
        if before is not None and not resume:
            told = f"{str(self._folder)!r} holds parts of an unfinished study: go on with --resume, or delete it"
            raise ConfigError.at("--out", told)
        if before is not None and before != self._about:
            other = ", ".join(
                f"{name} {before.get(name)!r}" for name in self._about if before.get(name) != self._about[name]
            )
            raise ConfigError.at("--resume", f"{str(self._folder)!r} holds parts of another study: its {other}")

    def __call__(self, name: str, kind: type[R], make: Callable[[], R], /) -> R:
        """Return the part, from its file if there is one."""
        path = self._folder / f"{''.join(c if c.isalnum() else '-' for c in name)}.npz"
        if path.exists():
            return _read(path, name, kind)
        made = make()
        if not (self._folder / ABOUT).exists():
            self._folder.mkdir(parents=True, exist_ok=True)
            write_text(self._folder / ABOUT, json.dumps(self._about) + "\n")
        _write(path, name, made)
        return made

    def forget(self) -> None:
        """Delete all parts: the study is done."""
        if (self._folder / ABOUT).exists():
            rmtree(self._folder)

    def _before(self) -> dict[str, Any] | None:
        if not (self._folder / ABOUT).exists():
            return None
        try:
            return read_table(self._folder / ABOUT)
        except InputError as error:
            told = f"does not say which study's parts these are: delete them ({error})"
            raise ConfigError.at(str(self._folder / ABOUT), told) from None


def _write(path: Path, name: str, part: Any) -> None:
    fields = {part_field.name: getattr(part, part_field.name) for part_field in attrs.fields(type(part))}
    arrays: dict[str, Any] = {field: value for field, value in fields.items() if value is not None} | {"its name": name}
    write_arrays(path, arrays)


def _read(path: Path, name: str, kind: type[R]) -> R:
    try:
        with open_arrays(path) as arrays:
            if str(arrays["its name"]) != name:
                raise ValueError(f"it is {str(arrays['its name'])!r}")
            stored = {each: arrays[each] for each in arrays.names}
        fields = [each.name for each in attrs.fields(kind)]  # type: ignore[arg-type]
        return kind(**{field: stored.get(field) for field in fields})
    except (InputError, ValueError, TypeError) as error:
        raise ConfigError.at(str(path), f"is not the part {name!r} of this study ({error}): delete it") from None
