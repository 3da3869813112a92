"""Take and join tracks in beliefs and innovations of any estimator: attrs values, tuples, arrays that lead with (*b, t)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, reduce
from operator import attrgetter
from typing import Any, TypeVar

import attrs
import numpy as np

from vedette.values import held, maker

T = TypeVar("T")


@attrs.frozen(eq=False)
class Common:
    """A value that all tracks have in common, such as the scan: it stays as it is where tracks are taken or joined."""

    value: Any


def take(tree: T, index: Any, axis: int) -> T:
    """Return the entries `index` (an integer or boolean array) of the tracks' axis of every array."""
    if isinstance(index, np.ndarray) and index.dtype == bool:
        index = np.flatnonzero(index)  # once for all arrays
    if isinstance(index, np.ndarray):
        return mapped(lambda array: array.take(index, axis), tree)
    return mapped(lambda array: array[(slice(None),) * axis + (index,)], tree)


def join(first: T, second: T, axis: int) -> T:
    """Return the tracks of `first`, then those of `second`; what one of them lacks, as None, both lack."""
    kind: Any = type(first)
    if first is None or second is None:
        return None  # type: ignore[return-value]
    if kind is np.ndarray:
        return np.concatenate((first, second), axis)  # type: ignore[arg-type, return-value]
    if kind is Common:
        return first
    get, make = _made_of(kind)
    return make([join(one, other, axis) for one, other in zip(get(first), get(second), strict=True)])


def in_order(trees: Sequence[T], rows: Sequence[Any] | None = None, axis: int = 0) -> T:
    """Return the tracks of all trees, one after the other, or where `rows` of each say."""
    joined = reduce(lambda one, other: join(one, other, axis), trees)
    return joined if rows is None else take(joined, np.argsort(np.concatenate(list(rows)), kind="stable"), axis)


def size(tree: Any) -> int:
    """Return the number of numbers in all arrays."""
    return int(tree.size) if isinstance(tree, np.ndarray) else sum(map(size, () if isinstance(tree, Common) else held(tree)))


def mapped(function: Callable[[Any], Any], tree: T) -> T:
    """Return the same of what `function` gives for every array."""
    kind: Any = type(tree)
    if kind is np.ndarray:
        return function(tree)
    if tree is None or kind is Common:
        return tree
    get, make = _made_of(kind)
    return make([mapped(function, part) for part in get(tree)])


@cache
def _made_of(cls: Any) -> tuple[Callable[[Any], tuple[Any, ...]], Callable[[list[Any]], Any]]:
    """Return what gets the parts of a value, and what makes one of them: not the constructor if that only stores."""
    if issubclass(cls, tuple):
        return tuple, tuple
    fields = attrs.fields(cls)
    names = [field.name for field in fields]
    stores = all(field.init and field.converter is None and field.validator is None for field in fields)
    plain = stores and "__slots__" in vars(cls) and not hasattr(cls, "__attrs_post_init__")
    make = maker(cls) if plain else cls
    get = attrgetter(*names) if len(names) > 1 else lambda tree: tuple(getattr(tree, name) for name in names)
    return get, lambda parts: make(*parts)
