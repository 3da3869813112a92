"""What is wrong with a value that a method returned: its kind, its shape, or that it is no number."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import attrs
import numpy as np

from vedette.roles import Component
from vedette.space import Space
from vedette.types import Gaussian

Shape = tuple[int, ...]


def told(value: Any) -> str:
    """Return a value in a few words: an array by its shape, anything else by its type."""
    if value is None:
        return "nothing"
    if isinstance(value, np.ndarray | np.generic):
        return f"{value.shape}" if value.dtype.kind in "biuf" else f"{value.shape} of {value.dtype.name} values"
    if isinstance(value, tuple | list):
        return f"a {type(value).__name__} of {len(value)}"
    return f"a {type(value).__name__}"


def arrays(value: Any) -> Iterator[np.ndarray[Any, Any]]:
    """Yield the arrays in a value: attrs values, tuples and arrays."""
    if isinstance(value, np.ndarray | np.floating | float):
        yield np.asarray(value)
    elif isinstance(value, tuple | list):
        for each in value:
            yield from arrays(each)
    elif attrs.has(type(value)) and not isinstance(value, Component | Space):
        for field in attrs.fields(type(value)):
            yield from arrays(getattr(value, field.name, None))


def is_tree(value: Any) -> bool:
    """Return whether a value is made of attrs values, tuples and arrays, as beliefs and memories are."""
    if isinstance(value, tuple):
        return all(map(is_tree, value))
    if isinstance(value, np.ndarray):
        return value.dtype.kind in "biuf"
    return isinstance(value, np.generic | float | int) or value is None or attrs.has(type(value))


def undefined(value: Any) -> int:
    """Count the numbers in a value that are nan."""
    return sum(int(np.count_nonzero(np.isnan(each))) for each in arrays(value) if each.dtype.kind == "f")


def infinite(value: Any) -> int:
    """Count the numbers in a value that are nan or infinite."""
    return sum(int(np.count_nonzero(~np.isfinite(each))) for each in arrays(value) if each.dtype.kind == "f")


def array_flaws(
    given: Any, gave: Any, batch: Shape, core: Shape, part: str = "", *, whole: bool = False, mask: bool = False
) -> Iterator[str]:
    """Yield what is wrong with an array (*batch, *core), whose batch axes may be missing unless it must be `whole`."""
    name = f"{part} " if part else ""
    if batch and not whole:
        right = f"{name}{_dims('*b', *core)} or {_dims(*core)}, *b being {batch} here"
    else:
        right = f"{name}{(*batch, *core)}"
    plain = isinstance(gave, np.ndarray | np.generic | float | int)
    if not plain or np.asarray(gave).dtype.kind not in ("b" if mask else "biuf"):
        kind = "true or false" if mask else "numbers"
        yield f"must return {right}, an array of {kind}; got {told(gave)}"
    elif not _fits(np.shape(gave), batch, core, whole):
        yield f"must return {right}; got {np.shape(gave)}"
    elif (count := undefined(gave)) and not undefined(tuple(given)):
        yield f"must return numbers; got nan in {count} of {np.size(gave)}{f' of {part}' if part else ''}"


def _dims(*axes: object) -> str:
    return f"({', '.join(map(str, axes))}{',' if len(axes) == 1 else ''})"


def _fits(shape: Shape, batch: Shape, core: Shape, whole: bool) -> bool:
    lead, own = shape[: len(shape) - len(core)], shape[len(shape) - len(core) :]
    if len(shape) < len(core) or own != core:
        return False
    if whole:
        return lead == batch
    return len(lead) <= len(batch) and all(a in (1, b) for a, b in zip(lead[::-1], batch[::-1], strict=False))


def gaussian_flaws(given: Any, gave: Any, batch: Shape, n: int, part: str = "") -> Iterator[str]:
    """Yield what is wrong with a Gaussian, mean (*batch, n) and cov (*batch, n, n)."""
    if not isinstance(gave, Gaussian):
        yield f"must return {f'{part}, ' if part else ''}a Gaussian(mean, cov); got {told(gave)}"
        return
    yield from array_flaws(given, gave.mean, batch, (n,), f"{part} mean".strip(), whole=True)
    yield from array_flaws(given, gave.cov, batch, (n, n), f"{part} cov".strip(), whole=True)
