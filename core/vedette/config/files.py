"""Read a config file as plain data. Data is never code: nothing in a file can run or refer to anything."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from vedette.config.plugins import draft_of
from vedette.config.texts import json_text, toml, yaml_text
from vedette.errors import ConfigError
from vedette.limits import DEEPEST, most

LARGEST = 10_000_000
"""Limits on the bytes of a file and the values of a config: more is a recording, or an attack by repeated references."""


def read_file(path: str | Path) -> dict[str, Any]:
    """Return the table in a TOML, YAML or JSON file, told apart by its ending; ConfigError with the path and the cure.

    For data that a plugin drafts a config for, such as a video, that draft is returned.
    """
    readers = {".toml": toml, ".yaml": yaml_text, ".yml": yaml_text, ".json": json_text}
    path = Path(path)
    place = str(path)
    reader = readers.get(path.suffix.lower())
    if reader is None:
        if path.suffix.lower() in (".csv", ".parquet"):
            raise ConfigError.at(place, "is data, not a config; `vedette new config` writes a config for it")
        there = path.exists()
        if path.suffix and not there:
            raise ConfigError.at(place, "there is no such file")
        text = draft_of(path, {}) if there else None
        if text is None:
            ending = f"must end in {', '.join(readers)}: the ending tells the format"
            raise ConfigError.at(
                place, "is a folder without video; of a run, name its config.json" if path.is_dir() else ending
            )
        return toml(text)
    text = _text(path)
    try:
        data = reader(text)
    except ImportError:
        cure = "pip install 'vedette[yaml]', or write the config as TOML or JSON"
        raise ConfigError.at(place, f"reading YAML needs pyyaml: {cure}") from None
    except RecursionError:
        raise ConfigError.at(place, f"is nested deeper than {DEEPEST} levels") from None
    except ValueError as error:
        raise ConfigError.at(place, f"is not well-formed {path.suffix[1:].upper()}: {error}") from None
    if not isinstance(data, dict):
        raise ConfigError.at(place, f"must hold a table of names, got {type(data).__name__}")
    return data


def _text(path: Path) -> str:
    place = str(path)
    try:
        if path.is_dir():
            raise ConfigError.at(place, "is a folder; name the file in it")
        if path.exists() and not path.is_file():
            raise ConfigError.at(place, "is no regular file")
        if path.stat().st_size > most(LARGEST):
            raise ConfigError.at(place, f"is larger than {most(LARGEST)} bytes: this is no config")
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise ConfigError.at(place, "there is no such file") from None
    except OSError as error:
        raise ConfigError.at(place, f"cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise ConfigError.at(place, f"is not UTF-8 text: {error.reason} at byte {error.start}") from None
    if not text.strip():
        raise ConfigError.at(place, "the file is empty")
    return text


def check_size(config: Mapping[str, Any]) -> None:
    """Refuse, with the first name of the path, what is nested too deep (or in itself) or has too many values."""
    known: dict[int, tuple[int, int]] = {}
    total = 0
    for name, value in config.items():
        height, size = _extent(value, DEEPEST, known)
        if height > DEEPEST:
            raise ConfigError.at(str(name), f"is nested deeper than {DEEPEST} levels")
        total += size
        if total > most(LARGEST):
            raise ConfigError.at(str(name), f"holds more than {most(LARGEST)} values")


def _extent(value: Any, room: int, known: dict[int, tuple[int, int]]) -> tuple[int, int]:
    """Return depth and number of values of plain data. The depth is right up to `room`, and more than it beyond.

    A part that is referred to again is not counted again, so that repeated references cost no time.
    """
    if not isinstance(value, Mapping | list | tuple):
        return 0, 1
    if room == 0:
        return 1, 1
    if id(value) not in known:
        parts = value.values() if isinstance(value, Mapping) else value
        extents = [_extent(part, room - 1, known) for part in parts]
        known[id(value)] = 1 + max((e[0] for e in extents), default=0), 1 + sum(e[1] for e in extents)
    return known[id(value)]
