"""Evaluations kept in a folder, so that `--resume` goes on with them: what was asked is not run again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from vedette import Array, ConfigError, VedetteError
from vedette_files.writing import write_text

ABOUT, EVALUATIONS = "tuning.json", "evaluations.jsonl"


class Kept:
    """The values that were asked for and what came of them, in memory, and in a folder if there is one.

    Each finished evaluation is a line of `evaluations.jsonl`, which a kill may tear in its last line alone.
    """

    def __init__(self, folder: Path | None, about: Mapping[str, Any], *, resume: bool) -> None:
        self._found: dict[tuple[float, ...], Array | None] = {}
        self._folder = folder
        self.resumed = 0
        if folder is None:
            return
        if (folder / ABOUT).exists():
            if not resume:
                told = f"{str(folder)!r} holds an unfinished tuning: go on with --resume, or delete its {ABOUT}"
                raise ConfigError.at("--out", told)
            self._check(dict(about))
            self._read()
        else:
            folder.mkdir(parents=True, exist_ok=True)
            (folder / EVALUATIONS).unlink(missing_ok=True)
            write_text(folder / ABOUT, json.dumps(dict(about), indent=2) + "\n")

    @property
    def then(self) -> str:
        """What is to be done where the tuning breaks off, to end a sentence."""
        return "" if self._folder is None else "; --resume goes on from here"

    def __contains__(self, values: tuple[float, ...]) -> bool:
        return values in self._found

    def __getitem__(self, values: tuple[float, ...]) -> Array | None:
        return self._found[values]

    def __len__(self) -> int:
        return len(self._found)

    def add(self, values: tuple[float, ...], figures: Array | None) -> None:
        """Keep what came of an evaluation: numbers (s,), or None where it cannot run. VedetteError if none can be kept."""
        self._found[values] = figures
        if self._folder is not None:
            line = json.dumps({"values": values, "found": None if figures is None else figures.tolist()})
            try:
                with (self._folder / EVALUATIONS).open("a", encoding="utf-8") as file:
                    file.write(line + "\n")
            except OSError as error:
                raise VedetteError(f"{self._folder}: {error.strerror or error}{self.then}") from None

    def forget(self) -> None:
        """Delete the files: the tuning is done."""
        if self._folder is not None:
            for name in (ABOUT, EVALUATIONS):
                (self._folder / name).unlink(missing_ok=True)

    def _check(self, about: dict[str, Any]) -> None:
        assert self._folder is not None
        try:
            before = json.loads((self._folder / ABOUT).read_text(encoding="utf-8"))
        except ValueError:
            before = None
        if before == json.loads(json.dumps(about)):
            return
        other = [name for name in about if not isinstance(before, dict) or before.get(name) != about[name]]
        text = f"{str(self._folder)!r} holds another tuning: its {', '.join(other) or 'description'} differs"
        raise ConfigError.at("--resume", text)

    def _read(self) -> None:
        assert self._folder is not None
        path = self._folder / EVALUATIONS
        lines = path.read_text(encoding="utf-8").split("\n") if path.exists() else []
        whole = []
        for line in lines:
            try:
                each = json.loads(line)
                values, found = tuple(map(float, each["values"])), each["found"]
            except (ValueError, KeyError, TypeError):
                continue
            self._found[values] = None if found is None else np.array(found, dtype=float)
            whole.append(line)
        self.resumed = len(whole)
        write_text(path, "".join(f"{line}\n" for line in whole))
