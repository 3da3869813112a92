"""The steps along paths compiled, where the plugin was built with a compiler: one piece after another."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import numpy as np

from vedette import kernels
from vedette.space import Array, Indices, Mask

_module: ModuleType | None
try:
    _module = import_module("vedette_tools._compiled")
except ModuleNotFoundError:
    _module = None

MOST_AXES, MOST_MODES = 2, 8
"""For which the module is made."""


def module(axes: int, modes: int = 1) -> ModuleType | None:
    """Return the module, if it was built, takes so many axes and modes, and the compiled kernels run."""
    fits = axes <= MOST_AXES and modes <= MOST_MODES and kernels.RUNNING.startswith("compiled")
    return _module if fits else None


def numbers(values: Any) -> Array:
    """Return dense doubles."""
    return np.ascontiguousarray(values, dtype=float)


def whole(values: Indices | Mask) -> Indices:
    """Return dense integers."""
    return np.ascontiguousarray(values, dtype=np.int64)
