"""The parameters of a component, by what they are."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np


def in_seconds(component: Any) -> dict[str, float]:
    """Return the parameters of a component that are times in s, by name, those left open apart."""
    return {name: float(value) for name, value in _in_unit(component, "s") if isinstance(value, float | int)}


def square(component: Any, unit: str) -> dict[str, np.ndarray[Any, Any]]:
    """Return the parameters of a component that are square matrices in `unit`, by name."""
    arrays = {name: value for name, value in _in_unit(component, unit) if isinstance(value, np.ndarray)}
    return {name: array for name, array in arrays.items() if array.ndim == 2 and array.shape[0] == array.shape[1] > 1}


def _in_unit(component: Any, unit: str) -> Iterator[tuple[str, Any]]:
    """Yield name and value of the parameters of a component that are in `unit`."""
    for parameter in attrs.fields(type(component)) if attrs.has(type(component)) else ():
        if parameter.init and parameter.metadata.get("unit") == unit:
            yield parameter.name, getattr(component, parameter.name)
