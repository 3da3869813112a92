"""The parameters of a component, by what they are."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np


def in_seconds(component: Any) -> dict[str, float]:
    """Return the parameters of a component that are times in s, by name, those left open apart."""
    found = {}
    for each in attrs.fields(type(component)) if attrs.has(type(component)) else ():
        value = getattr(component, each.name)
        if each.init and each.metadata.get("unit") == "s" and isinstance(value, float | int):
            found[each.name] = float(value)
    return found


def square(component: Any, unit: str) -> dict[str, np.ndarray[Any, Any]]:
    """Return the parameters of a component that are square matrices in `unit`, by name."""
    found = {}
    for each in attrs.fields(type(component)) if attrs.has(type(component)) else ():
        value = getattr(component, each.name)
        matrix = isinstance(value, np.ndarray) and value.ndim == 2 and value.shape[0] == value.shape[1] > 1
        if each.init and matrix and each.metadata.get("unit") == unit:
            found[each.name] = value
    return found
