"""Take and join tracks in beliefs and innovations of any estimator: attrs values, tuples, arrays that lead with (*b, t)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache, reduce
from typing import Any, TypeVar

import attrs
import numpy as np

from vedette.values import maker

T = TypeVar("T")


@attrs.frozen(eq=False)
class Common:
    """A value that all tracks have in common, such as the scan: it stays as it is where tracks are taken or joined."""

    value: Any


def take(tree: T, index: Any, axis: int) -> T:
    """Return the entries `index` (an integer or boolean array) of the tracks' axis of every array."""
    if isinstance(index, np.ndarray) and index.dtype == bool:
        index = np.flatnonzero(index)  # once for all arrays
    if isinstance(tree, np.ndarray) and isinstance(index, np.ndarray):
        return tree.take(index, axis)  # type: ignore[return-value]
    if isinstance(tree, np.ndarray):
        return tree[(slice(None),) * axis + (index,)]  # type: ignore[return-value]
    return _rebuild(tree, [take(part, index, axis) for part in _parts(tree)])


def join(first: T, second: T, axis: int) -> T:
    """Return the tracks of `first`, then those of `second`."""
    if isinstance(first, np.ndarray):
        return np.concatenate([first, second], axis=axis)  # type: ignore[return-value]
    pairs = zip(_parts(first), _parts(second), strict=True)
    return _rebuild(first, [join(one, other, axis) for one, other in pairs])


def in_order(trees: Sequence[T], rows: Sequence[Any] | None = None) -> T:
    """Return the tracks of all trees, one after the other, or where `rows` of each say."""
    joined = reduce(lambda one, other: join(one, other, 0), trees)
    return joined if rows is None else take(joined, np.argsort(np.concatenate(list(rows)), kind="stable"), 0)


def size(tree: Any) -> int:
    """Return the number of numbers in all arrays."""
    return int(tree.size) if isinstance(tree, np.ndarray) else sum(size(part) for part in _parts(tree))


def _parts(tree: Any) -> list[Any]:
    if tree is None or isinstance(tree, Common):
        return []
    if isinstance(tree, tuple):
        return list(tree)
    names, _ = _made_of(type(tree))  # type: ignore[arg-type]  # a class is hashable
    return [getattr(tree, name) for name in names]


def _rebuild(tree: T, parts: list[Any]) -> T:
    if tree is None or isinstance(tree, Common):
        return tree
    if isinstance(tree, tuple):
        return tuple(parts)  # type: ignore[return-value]
    _, make = _made_of(type(tree))  # type: ignore[arg-type]
    return make(*parts)  # type: ignore[no-any-return]


@cache
def _made_of(cls: Any) -> tuple[tuple[str, ...], Callable[..., Any]]:
    """Return the names of a class's fields, and what makes its values of them: not its constructor if that only stores."""
    fields = attrs.fields(cls)
    stores = all(field.init and field.converter is None and field.validator is None for field in fields)
    plain = stores and "__slots__" in vars(cls) and not hasattr(cls, "__attrs_post_init__")
    return tuple(field.name for field in fields), maker(cls) if plain else cls
