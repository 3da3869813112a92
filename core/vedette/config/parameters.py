"""The parameters of a class, read from its attrs fields and annotations: the only schema there is.

The registry lists it, configs are built and written by it, and the JSON Schema is generated from it.
"""

from __future__ import annotations

import types
from collections.abc import Iterable, Mapping
from pathlib import PurePath
from typing import Any, Union, get_args, get_origin

import attrs
import numpy as np
from attrs import frozen

from vedette.roles import Associator, Component, Estimator, MotionModel, Sensor
from vedette.streams import Format, Input, Output, Store
from vedette.supporting import Birth, Command, Lifecycle, Picture, Preprocessor, Reproduction, Source

ROLES: dict[str, type[Component]] = {
    "motion": MotionModel,
    "sensor": Sensor,
    "associator": Associator,
    "estimator": Estimator,
    "birth": Birth,
    "lifecycle": Lifecycle,
    "preprocessor": Preprocessor,
    "source": Source,
    "input": Input,
    "format": Format,
    "output": Output,
    "store": Store,
    "reproduction": Reproduction,
    "command": Command,
    "picture": Picture,
}
"""Role names as configs, commands and messages use them."""

APART = ("reproduction", "command", "picture")
"""Roles whose components no config holds: studies of papers, commands and pictures."""


@frozen
class Leaf:
    """A value that the field's own converter and validator check."""

    hint: Any


@frozen
class Part:
    """A component of a role, named by its kind; `base` is the role's class, or a narrower one."""

    role: str
    base: type[Component]


@frozen
class Table:
    """A plain attrs class: a table of its parameters."""

    cls: type


@frozen
class Many:
    """A list."""

    item: Shape


@frozen
class Names:
    """A table whose names are the user's own."""

    item: Shape


@frozen
class Maybe:
    """The item, or nothing."""

    item: Shape


Shape = Leaf | Part | Table | Many | Names | Maybe


@frozen
class Parameter:
    """One parameter of a class: `name` as a config writes it, and the shape of what it takes."""

    name: str
    shape: Shape
    field: attrs.Attribute[Any]

    @property
    def required(self) -> bool:
        """Whether a config must give it."""
        return self.field.default is attrs.NOTHING

    @property
    def default(self) -> Any:
        """The default value; NOTHING if it is required, or made from other parameters."""
        default: Any = self.field.default
        if isinstance(default, attrs.Factory):  # type: ignore[arg-type]  # attrs types this class as a function
            return attrs.NOTHING if default.takes_self else default.factory()
        return default

    @property
    def unit(self) -> str:
        """SI unit, "1" for a pure number, "" for anything that is not a number."""
        return str(self.field.metadata.get("unit", ""))

    @property
    def meaning(self) -> str:
        """Its sentence, with the unit if there is one."""
        doc = str(self.field.metadata.get("doc", ""))
        return f"{doc}, in {self.unit}" if self.unit not in ("", "1") else doc

    def describe(self) -> dict[str, Any]:
        """Return a full description as plain data: name, type, unit, doc, required; default, limits, options if any."""
        metadata = self.field.metadata
        return {
            "name": self.name,
            "type": in_words(self.shape, metadata.get("ndim")),
            "unit": self.unit,
            "doc": str(metadata.get("doc", "")),
            "required": self.required,
            **({} if self.default is attrs.NOTHING else {"default": plain(self.default)}),
            **{key: plain(metadata[key]) for key in ("limits", "options") if metadata.get(key)},
        }


def role_of(cls: type) -> str | None:
    """Return the name of a class's role: that of the first of its bases that is one."""
    names = {base: name for name, base in ROLES.items()}
    return next((names[base] for base in cls.__mro__ if base in names), None)


def parameters(cls: type) -> tuple[Parameter, ...]:
    """Return the parameters that a config may give for an attrs class, in order; TypeError if the class is ambiguous."""
    try:
        attrs.resolve_types(cls, include_extras=False)  # once a class: attrs remembers, and it takes a while
    except Exception as error:
        raise TypeError(f"its annotations cannot be resolved: {error}") from error
    return tuple(_parameter(field, field.type or Any) for field in attrs.fields(cls) if field.init)


def _parameter(field: attrs.Attribute[Any], hint: Any) -> Parameter:
    try:
        shape = shape_of(hint)
    except TypeError as error:
        raise TypeError(f"{field.name}: {error}") from None
    if not holds_parts(shape) and field.converter is None and field.validator is None:
        raise TypeError(f"{field.name}: nothing checks what a config says; declare it through vedette.fields")
    return Parameter(field.alias or field.name, shape, field)


def shape_of(hint: Any) -> Shape:
    """Return the shape of a field annotated with `hint`; TypeError for components in places that a config cannot fill."""
    hint = _unaliased(hint)
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType) and len(arguments) == 2 and types.NoneType in arguments:
        return Maybe(shape_of(next(argument for argument in arguments if argument is not types.NoneType)))
    if origin is tuple and len(arguments) == 2 and arguments[1] is Ellipsis:
        return Many(shape_of(arguments[0]))
    if origin in (dict, Mapping) and arguments[0] is str:
        return Names(shape_of(arguments[1]))
    cls = origin or hint
    if isinstance(cls, type) and Component in cls.__mro__:  # `issubclass` would ask all components, of an abstract class
        role = role_of(cls)
        if role is None:
            raise TypeError(f"{cls.__name__} plays none of the roles {', '.join(ROLES)}")
        return Part(role, cls)
    if isinstance(cls, type) and attrs.has(cls):
        return Table(cls)
    if any(holds_parts(shape_of(argument)) for argument in arguments):
        raise TypeError(f"a config cannot fill {hint}: use X, X | None, tuple[X, ...] or dict[str, X]")
    return Leaf(hint)


def _unaliased(hint: Any) -> Any:
    """Return the type that a type alias stands for (numpy's NDArray is one from numpy 2.5 on); any other hint as it is."""
    alias, arguments = get_origin(hint) or hint, get_args(hint)
    if not hasattr(alias, "__value__"):  # Python 3.11 has no typing.TypeAliasType
        return hint
    return _unaliased(alias.__value__[arguments] if arguments else alias.__value__)


def holds_parts(shape: Shape) -> bool:
    """Return whether a config is walked into it; otherwise the field's own converter and validator take it whole."""
    return isinstance(_innermost(shape), Part | Table)


def _innermost(shape: Shape) -> Shape:
    """Return the shape of what a list, a table of names or what may be nothing holds; any other as it is."""
    return _innermost(shape.item) if isinstance(shape, Many | Names | Maybe) else shape


def words_of(cls: type) -> Mapping[str, Mapping[str, Any]]:
    """Return the words that a config may write for a plain attrs class, each with the table that it stands for."""
    return getattr(cls, "words", {})


def tables(given: Iterable[Parameter]) -> list[type]:
    """Return every plain attrs class that some parameters lead to, each once; TypeError if one is ambiguous."""
    reached: list[type] = []
    todo = [_innermost(parameter.shape) for parameter in given]
    while todo:
        shape = todo.pop()
        if isinstance(shape, Table) and shape.cls not in reached:
            reached.append(shape.cls)
            try:
                todo += [_innermost(parameter.shape) for parameter in parameters(shape.cls)]
            except TypeError as error:
                raise TypeError(f"{shape.cls.__name__}: {error}") from error
    return reached


_LEAVES: dict[Any, str] = {float: "number", int: "whole number", bool: "true or false", str: "text", Any: "value"}
_ARRAYS = {1: "list of numbers", 2: "matrix"}
_PLURALS = {"motion": "motion models", "whole number": "whole numbers"}


def _several(shape: Shape) -> str:
    """Return the plural name of a shape."""
    if isinstance(shape, Table):
        return f"tables {shape.cls.__name__}"
    one = in_words(shape)
    return _PLURALS.get(one, f"{one}s" if one.isalpha() else one)


def in_words(shape: Shape, ndim: int | None = None) -> str:
    """Describe a shape for a listing; `ndim` is known for arrays."""
    match shape:
        case Part(role, _):
            return role
        case Table(cls):
            return " or ".join([f"table {cls.__name__}", *map(repr, words_of(cls))])
        case Many(item):
            return f"list of {_several(item)}"
        case Names(item):
            return f"names to {_several(item)}"
        case Maybe(item):
            return f"{in_words(item, ndim)} or nothing"
        case Leaf(hint) if get_origin(hint) is tuple:
            return f"[{', '.join(in_words(shape_of(argument)) for argument in get_args(hint))}]"
        case Leaf(hint) if get_origin(hint) is np.ndarray:
            return _ARRAYS.get(ndim or 0, "array")
        case Leaf(hint):
            return _LEAVES.get(hint, str(getattr(hint, "__name__", hint)))


def plain(value: Any) -> Any:
    """Return `value` as numbers, strings, lists and tables; components and attrs values as tables that build an equal."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, PurePath):
        return str(value)
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if not attrs.has(type(value)):
        raise TypeError(f"a config cannot hold a {type(value).__name__}: {value!r}")
    kind = {"kind": value.kind} if isinstance(value, Component) else {}
    values = [(parameter, getattr(value, parameter.field.name)) for parameter in parameters(type(value))]
    return kind | {p.name: plain(item) for p, item in values if not (item is None and p.field.default is None)}
