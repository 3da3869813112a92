"""Numbers as text: by a compiled module where the plugin was built with a compiler, whose bytes are Python's own."""

from __future__ import annotations

import math
from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

_compiled: Callable[[Any], list[str]] | None
try:
    _compiled = import_module("vedette_files._texts").texts
except ModuleNotFoundError:
    _compiled = None


def texts(numbers: Any) -> list[str]:
    """Return numbers, flat, as they read back to the last bit, and `null` where one is not finite."""
    flat = np.ascontiguousarray(numbers, dtype=float).ravel()
    return plain_texts(flat) if _compiled is None else _compiled(flat)


def plain_texts(numbers: Any) -> list[str]:
    """Return what `texts` does, without the compiled module."""
    return [repr(number) if math.isfinite(number) else "null" for number in numbers.tolist()]
