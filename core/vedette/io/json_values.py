"""Numbers out of JSON, without guessing: no strings, no true and false, nothing that is not finite."""

from __future__ import annotations

import json
from typing import Any

from vedette.fields import ABSURD


def parse(text: str) -> Any:
    """What a JSON text says; ValueError with line, column and cause."""
    try:
        return json.loads(text)
    except json.JSONDecodeError as error:
        where = f"line {error.lineno}, column {error.colno}" if "\n" in text else f"column {error.colno}"
        raise ValueError(f"is not JSON, or cut short, at {where}: {error.msg}") from None
    except (ValueError, RecursionError) as error:
        raise ValueError(f"is not JSON that can be read: {error}") from None


def number(value: Any, what: str) -> float:
    """A finite number; ValueError says that `what` must be one."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= ABSURD:
        raise ValueError(f"{what} must be a finite number of at most {ABSURD:g}, got {short(value)}")
    return float(value)


def vector(value: Any, what: str, length: int | None = None) -> list[float]:
    """A list of finite numbers, of a `length` if given; ValueError says that `what` must be one."""
    if not isinstance(value, list) or (length is not None and len(value) != length):
        count = "" if length is None else f"{length} "
        raise ValueError(f"{what} must be a list of {count}numbers, got {short(value)}")
    return [number(item, f"{what}[{i}]") for i, item in enumerate(value)]


def short(value: Any) -> str:
    """A value as a message shows it."""
    text = json.dumps(value)
    return text if len(text) <= 80 else f"{text[:77]}..."
