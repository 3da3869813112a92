"""Numbers from JSON, without guessing: no strings, no booleans, nothing that is not finite."""

from __future__ import annotations

import json
from typing import Any

from vedette.fields import ABSURD
from vedette.reading import DEEPEST, parse_json

parse = parse_json
__all__ = ["DEEPEST", "number", "parse", "short", "vector"]


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
