"""Values: what one holds, and those of the per-scan path, made without the cost of a frozen class's own constructor."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TypeVar

import attrs

T = TypeVar("T", bound=attrs.AttrsInstance)

try:
    from vedette._values import Evolver, Maker
except ImportError:  # not compiled here: see `vedette info`
    Evolver = Maker = None  # type: ignore[assignment, misc]

COMPILED = Maker is not None
"""Whether values are made by compiled code."""

MOST = 32
"""Fields that compiled code takes (core/cpp/slots.hpp); classes of more make their values themselves."""


def held(value: Any) -> list[Any]:
    """Return what a tuple, a list or a table holds, or all fields of an attrs value; nothing of any other."""
    if isinstance(value, tuple | list):
        return list(value)
    if isinstance(value, Mapping):
        return list(value.values())
    return [getattr(value, field.name) for field in attrs.fields(type(value))] if attrs.has(type(value)) else []


def maker(cls: type[T]) -> Callable[..., T]:
    """Return a function of all fields of an attrs class, in order, that makes its values as calling `cls` would.

    `cls` must have slots and a constructor that only stores its arguments. If nothing is compiled, and for
    more than `MOST` fields, it is `cls` itself; compiled, a value takes a fifth of the time.
    """
    return Maker(cls, _fields(cls)) if _is_taken(cls) else cls


def evolver(cls: type[T]) -> Callable[..., T]:
    """Return `attrs.evolve` for values of a class as `maker` takes it: of a value, and of the fields to change, by name."""
    return Evolver(cls, _fields(cls)) if _is_taken(cls) else attrs.evolve


def _is_taken(cls: type[attrs.AttrsInstance]) -> bool:
    return COMPILED and len(attrs.fields(cls)) <= MOST


def _fields(cls: type[attrs.AttrsInstance]) -> tuple[str, ...]:
    return tuple(field.name for field in attrs.fields(cls))
