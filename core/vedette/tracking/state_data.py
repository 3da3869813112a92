"""States as plain data and back: numbers, texts, lists and tables that JSON holds, and no code.

Arrays are written whole, as their bytes in base64, so that they read back to the last bit. A class is named, and only the
classes that the tracker's own state leads to are made again, so that nothing that was written can choose what is called.
"""

from __future__ import annotations

import math
import types
from base64 import b64decode, b64encode
from collections.abc import Iterator, Mapping
from typing import Any, TypeVar, Union, get_args, get_origin

import attrs
import numpy as np

from vedette.errors import InputError
from vedette.sampling.seeds import Seed
from vedette.values import held

VERSION = 1
"""Of this form."""

KINDS = "biuf"
"""Kinds of arrays that are read: of truth values and numbers."""


T = TypeVar("T")


def written(state: Any) -> dict[str, Any]:
    """Return a state as plain data, with the version of its form."""
    return {"version": VERSION, "state": to_data(state)}


def read(data: Any, like: T) -> T:
    """Return the state that `written` wrote, of the classes that a state `like` it leads to; InputError with its place."""
    version = data.get("version") if isinstance(data, Mapping) else None
    if version != VERSION or "state" not in data:
        raise InputError(f"state: must be of version {VERSION}, is of {version!r}")
    state = from_data(data["state"], classes_in(like))
    if not isinstance(state, type(like)):
        raise InputError(f"state: must be a {type(like).__name__}, is a {type(state).__name__}")
    return state


def to_data(value: Any, place: str = "state") -> Any:
    """Return attrs values, tuples, tables, arrays and numbers as plain data; TypeError with the place of anything else."""
    if value is None or isinstance(value, bool | str):
        return value
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        number = float(value)
        return number if math.isfinite(number) else {"float": repr(number)}
    if isinstance(value, np.ndarray) and value.dtype.kind in KINDS:
        content = np.ascontiguousarray(value, dtype=value.dtype.newbyteorder("<"))
        return {"array": content.dtype.str, "shape": list(value.shape), "bytes": b64encode(content.tobytes()).decode()}
    if isinstance(value, tuple):
        return [to_data(part, f"{place}[{i}]") for i, part in enumerate(value)]
    if isinstance(value, Mapping):
        return {"table": [[to_data(key, place), to_data(part, f"{place}[{key!r}]")] for key, part in value.items()]}
    if attrs.has(type(value)):
        names = [field.name for field in attrs.fields(type(value)) if field.init]
        parts = {name: to_data(getattr(value, name), f"{place}.{name}") for name in names}
        return {"value": name_of(type(value)), "parts": parts}
    raise TypeError(f"{place}: a {type(value).__name__} cannot be written: a state holds attrs values, tuples and arrays")


def from_data(data: Any, known: Mapping[str, type], place: str = "state") -> Any:
    """Return what `to_data` wrote, of `known` classes by name; InputError with the place of what cannot be read."""
    if data is None or isinstance(data, bool | int | float | str):
        return data
    if isinstance(data, list):
        return tuple(from_data(part, known, f"{place}[{i}]") for i, part in enumerate(data))
    try:
        if "float" in data:
            return {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}[data["float"]]
        if "array" in data:
            return _array(data)
        if "table" in data:
            return {from_data(k, known, place): from_data(part, known, f"{place}[{k!r}]") for k, part in data["table"]}
        cls, parts = known.get(data["value"]), data["parts"]
        if cls is None:
            raise InputError(f"{place}: holds a {data['value']!r}, which no state of this tracker does")
        fields = {field.name: field.alias or field.name for field in attrs.fields(cls) if field.init}
        if parts.keys() != fields.keys():
            raise InputError(f"{place}: {data['value']!r} must have {', '.join(fields)}, has {', '.join(map(str, parts))}")
        return cls(**{fields[name]: from_data(part, known, f"{place}.{name}") for name, part in parts.items()})
    except InputError:
        raise
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise InputError(f"{place}: cannot be read: {type(error).__name__}: {error}") from None


def _array(data: Mapping[str, Any]) -> np.ndarray[Any, Any]:
    dtype, shape = np.dtype(str(data["array"])), tuple(data["shape"])
    if dtype.kind not in KINDS or not all(type(length) is int and length >= 0 for length in shape):
        raise ValueError(f"an array of {dtype} and shape {shape}")
    content = b64decode(data["bytes"], validate=True)
    if len(content) != math.prod(shape) * dtype.itemsize:
        raise ValueError(f"{len(content)} bytes do not make {shape} of {dtype}")
    return np.frombuffer(content, dtype).reshape(shape).astype(dtype.newbyteorder("="))


def name_of(cls: type) -> str:
    """Return the name by which a class is written."""
    return f"{cls.__module__}.{cls.__qualname__}"


def classes_in(*values: Any) -> dict[str, type]:
    """Return by name the attrs classes that values hold, and those that their fields are declared to."""
    todo = [cls for value in values for cls in _classes_of(value)]
    known: dict[str, type] = {name_of(Seed): Seed}
    while todo:
        cls = todo.pop()
        if name_of(cls) not in known or cls is Seed:
            known[name_of(cls)] = cls
            todo += [declared for declared in _declared(cls) if name_of(declared) not in known]
    return known


def _classes_of(value: Any) -> Iterator[type]:
    if attrs.has(type(value)):
        yield type(value)
    for part in held(value):
        yield from _classes_of(part)


def _declared(cls: type) -> Iterator[type]:
    """Yield the attrs classes in the annotations of a class's fields."""
    try:
        attrs.resolve_types(cls)
    except NameError:  # a name for type checkers alone: what the values themselves hold is known all the same
        return
    for field in attrs.fields(cls):
        yield from _in_hint(field.type)


def _in_hint(hint: Any) -> Iterator[type]:
    origin = get_origin(hint)
    if origin in (Union, types.UnionType) or origin in (tuple, dict, Mapping):
        for argument in get_args(hint):
            yield from _in_hint(argument)
    elif isinstance(hint, type) and attrs.has(hint):
        yield hint
    elif isinstance(hint, TypeVar):
        yield from _in_hint(hint.__bound__)
    elif isinstance(origin, type) and attrs.has(origin):
        yield origin
