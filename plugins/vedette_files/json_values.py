"""Numbers from JSON, without guessing: no strings, no booleans, nothing that is not finite."""

from __future__ import annotations

import json
from typing import Any

from vedette.fields import ABSURD

DEEPEST = 32
"""Lists and objects inside each other, as in a config; a scan with covariances takes four."""


def parse(text: str) -> Any:
    """Return what a JSON text says; ValueError with line, column and cause."""
    try:
        found = json.loads(text)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}" if "\n" in text else f"column {error.colno}"
        raise ValueError(f"is not JSON, or cut short, at {where}: {error.msg}") from None
    except RecursionError:
        raise ValueError(f"is nested deeper than {DEEPEST} levels") from None
    except ValueError as error:
        raise ValueError(f"is not JSON that can be read: {error}") from None
    _check_depth(found)
    if "\\u" in text:
        _check_characters(found)
    return found


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
