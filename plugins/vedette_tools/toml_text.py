"""Keys, values and comments as TOML writes them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from typing import Any

_BARE = re.compile(r"[A-Za-z0-9_-]+")


def key(name: str) -> str:
    """Return a key, in quotes where it needs them."""
    return name if _BARE.fullmatch(name) else json.dumps(name, ensure_ascii=False)


def value(given: Any) -> str:
    """Return a value on one line; what is None in a table is left out."""
    if isinstance(given, Mapping):
        inner = ", ".join(f"{key(name)} = {value(each)}" for name, each in given.items() if each is not None)
        return f"{{ {inner} }}" if inner else "{}"
    if isinstance(given, list | tuple):
        return f"[{', '.join(map(value, given))}]"
    return repr(given) if isinstance(given, float) else json.dumps(given, ensure_ascii=False)


def comment(text: str) -> str:
    """Return a text for a comment: with ? for what would end the line or cannot be printed."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
