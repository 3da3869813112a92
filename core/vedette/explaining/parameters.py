"""The components of an experiment with their places in its config."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from vedette.config import INLINE
from vedette.experiment import Experiment
from vedette.roles import Component


def parts(value: Any, place: str = "") -> Iterator[tuple[str, Component]]:
    """Yield each component below `value`, outer ones first, with its place in the config."""
    if isinstance(value, Component):
        yield place, value
    if attrs.has(type(value)):
        inner = [(each.name, getattr(value, each.name)) for each in attrs.fields(type(value)) if each.init]
        for name, part in inner:
            inline = isinstance(value, Experiment) and name == INLINE
            yield from parts(part, place if inline else f"{place}.{name}".lstrip("."))
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from parts(part, f"{place}.{name}")
    elif isinstance(value, list | tuple):
        for i, part in enumerate(value):
            yield from parts(part, f"{place}[{i}]")


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
