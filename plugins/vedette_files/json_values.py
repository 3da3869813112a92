"""JSON from elsewhere: read up to stated limits, its numbers without guessing: no strings, no booleans, nothing infinite."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from vedette.errors import InputError
from vedette.fields import ABSURD
from vedette.limits import DEEPEST, most

LARGEST_TABLE = 2**26
"""Bytes of a JSON file that is read whole."""


def parse(text: str) -> Any:
    """Return what a JSON text says; ValueError with line, column and cause, or for a name that is twice in one object."""
    try:
        value = _DECODER.decode(text)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}" if "\n" in text else f"column {error.colno}"
        raise ValueError(f"is not JSON, or cut short, at {where}: {error.msg}") from None
    except RecursionError:
        raise ValueError(f"is nested deeper than {DEEPEST} levels") from None
    except ValueError as error:
        raise ValueError(f"is not JSON that can be read: {error}") from None
    _check_depth(value)
    if "\\u" in text:
        _check_characters(value)
    return value


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return an object; ValueError for a name that it has twice, of which the last would win in silence."""
    made = dict[str, Any]()
    for name, value in pairs:
        if name in made:
            raise ValueError(f"{short(name)} appears twice in one object")
        made[name] = value
    return made


_DECODER = json.JSONDecoder(object_pairs_hook=_once)


def read_table(path: Path, missing: str = "there is no such file") -> dict[str, Any]:
    """Return the object in a JSON file; InputError if it cannot be read, is too large or holds something else."""
    limit = most(LARGEST_TABLE)
    try:
        if path.exists() and not path.is_file():
            raise InputError(f"{path}: is no regular file")
        with path.open("rb") as file:
            data = file.read(limit + 1)
        if len(data) > limit:
            raise InputError(f"{path}: is larger than {limit:,} bytes; --limits raises that")
        value = parse(data.decode("utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        raise InputError(f"{path}: {missing}") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text: {error.reason} at byte {error.start}") from None
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
    if not isinstance(value, dict):
        raise InputError(f"{path}: must be a table of names, got {type(value).__name__}")
    return value


def number(value: Any, what: str) -> float:
    """Return a finite number; ValueError says that `what` must be one."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= ABSURD:
        raise ValueError(f"{what} must be a finite number of at most {ABSURD:g}, got {short(value)}")
    return float(value)


def vector(value: Any, what: str, length: int | None = None) -> list[float]:
    """Return a list of finite numbers, of a `length` if given; ValueError says that `what` must be one."""
    if not isinstance(value, list) or (length is not None and len(value) != length):
        count = "" if length is None else f"{length} "
        raise ValueError(f"{what} must be a list of {count}numbers, got {short(value)}")
    return [number(item, f"{what}[{i}]") for i, item in enumerate(value)]


def short(value: Any) -> str:
    """Format a value for a message."""
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


def _check_depth(value: Any) -> None:
    """ValueError for what is nested too deep, without a recursion of its own."""
    level = [value]
    for _ in range(DEEPEST):
        level = [
            part
            for each in level
            if isinstance(each, list | dict)
            for part in (each.values() if isinstance(each, dict) else each)
            if isinstance(part, list | dict)
        ]
        if not level:
            return
    raise ValueError(f"is nested deeper than {DEEPEST} levels")


def _check_characters(value: Any) -> None:
    """ValueError for a lone surrogate: it could be neither printed nor written."""
    try:
        json.dumps(value, ensure_ascii=False).encode()
    except UnicodeEncodeError:
        raise ValueError("holds half a character: a \\u escape between d800 and dfff without its other half") from None
