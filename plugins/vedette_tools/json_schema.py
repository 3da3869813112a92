"""The JSON Schema of all that is installed, so that an editor completes and checks a config as it is written."""

from __future__ import annotations

from argparse import ArgumentParser
from collections.abc import Iterable, Mapping
from typing import Any, get_args, get_origin

import attrs
import numpy as np

from vedette import Command, Component, Experiment, Registry, Tracker, display
from vedette.config import INLINE
from vedette.config.parameters import (
    ROLES,
    Leaf,
    Many,
    Maybe,
    Names,
    Parameter,
    Part,
    Shape,
    Table,
    parameters,
    plain,
    tables,
    words_of,
)
from vedette.units import spellings

_NUMBER = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?"
_LIMITS = {"above": "exclusiveMinimum", "at_least": "minimum", "below": "exclusiveMaximum", "at_most": "maximum"}


def schema(registry: Registry | None = None) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a config: shapes, names, ranges and units, not rules across parameters."""
    registry = Registry.installed() if registry is None else registry
    top = [p for p in (*parameters(Tracker), *parameters(Experiment)) if p.name != INLINE]
    definitions: dict[str, Any] = {role: _any_of(registry, Part(role, base)) for role, base in ROLES.items()}
    for entry in registry:
        kind = {"kind": {"const": entry.kind}, **_options(entry.cls)}
        definitions[f"{entry.role}.{entry.kind}"] = _table(entry.parameters, registry, entry.summary, kind)
    for cls in tables([*top, *(parameter for entry in registry for parameter in entry.parameters)]):
        summary = display.about(cls).partition("\n")[0]
        definitions[_name(cls)] = _table(parameters(cls), registry, summary, {})
    document = _table(top, registry, "A tracker, its source and its judge.", {})
    document["properties"] = {"$schema": {"type": "string"}, **document["properties"]}
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Vedette config"}
    return head | document | {"$defs": definitions}


def _options(cls: type[Component]) -> dict[str, Any]:
    """Return the options and arguments of a command by their names, in words; none for any other component."""
    if not issubclass(cls, Command):
        return {}
    parser = ArgumentParser(add_help=False)
    cls().options(parser)
    return {
        action.dest: {"description": action.help or ""} | ({"enum": [*action.choices]} if action.choices else {})
        for action in parser._actions
    }


def _name(cls: type) -> str:
    return f"{cls.__module__}.{cls.__qualname__}"


def _any_of(registry: Registry, part: Part) -> dict[str, Any]:
    """Return the schema of any installed component of a role, or of a narrower base."""
    kinds = [entry.kind for entry in registry.of_role(part.role) if issubclass(entry.cls, part.base)]
    return {"oneOf": [{"$ref": f"#/$defs/{part.role}.{kind}"} for kind in kinds]} if kinds else {"not": {}}


def _table(declared: Iterable[Parameter], registry: Registry, summary: str, kind: Mapping[str, Any]) -> dict[str, Any]:
    declared = list(declared)
    return {
        "type": "object",
        "description": summary,
        "properties": {**kind, **{parameter.name: _property(parameter, registry) for parameter in declared}},
        "required": [*(["kind"] if kind else []), *(parameter.name for parameter in declared if parameter.required)],
        "additionalProperties": False,
    }


def _property(parameter: Parameter, registry: Registry) -> dict[str, Any]:
    about: dict[str, Any] = {"description": parameter.meaning} if parameter.meaning else {}
    if parameter.default is not attrs.NOTHING and parameter.default is not None:
        about["default"] = plain(parameter.default)
    return _shape(parameter.shape, parameter, registry) | about


def _shape(shape: Shape, parameter: Parameter, registry: Registry) -> dict[str, Any]:
    match shape:
        case Maybe(item):
            return {"anyOf": [_shape(item, parameter, registry), {"type": "null"}]}
        case Many(item):
            return {"type": "array", "items": _shape(item, parameter, registry)}
        case Names(item):
            return {"type": "object", "additionalProperties": _shape(item, parameter, registry)}
        case Part(role, base):
            return {"$ref": f"#/$defs/{role}"} if base is ROLES[role] else _any_of(registry, shape)
        case Table(cls):
            table = {"$ref": f"#/$defs/{_name(cls)}"}
            return {"anyOf": [table, {"enum": list(words)}]} if (words := words_of(cls)) else table
        case Leaf(hint):
            # What another converter accepts is unknown: the schema allows anything.
            return _leaf(hint, parameter.field.metadata) if "read" in parameter.field.metadata else {}


def _leaf(hint: Any, metadata: Mapping[str, Any]) -> dict[str, Any]:
    if metadata.get("options"):
        return {"enum": list(metadata["options"])}
    if hint in (bool, str):
        return {"type": "boolean" if hint is bool else "string"}
    if hint in (float, int):
        limits = {_LIMITS[name]: bound for name, bound in metadata.get("limits", {}).items()}
        return _number("integer" if hint is int else "number", limits, str(metadata["unit"]))
    if get_origin(hint) is np.ndarray:
        numbers: dict[str, Any] = {"type": "number"}
        for _ in range(metadata["ndim"]):
            numbers = {"type": "array", "items": numbers}
        return numbers
    if get_origin(hint) is tuple:
        items = [_leaf(argument, metadata) for argument in get_args(hint)]
        return {"type": "array", "prefixItems": items, "minItems": len(items), "maxItems": len(items)}
    return {}


def _number(kind: str, limits: Mapping[str, float], unit: str) -> dict[str, Any]:
    """Return the schema of a number within limits, or a string of a number and, if it has one, a unit."""
    units = "|".join(written.replace("^", r"\^").replace(".", r"\.") for written in spellings(unit))
    tail = rf"(\s*({units}))?" if units else ""
    return {"anyOf": [{"type": kind, **limits}, {"type": "string", "pattern": rf"^\s*{_NUMBER}{tail}\s*$"}]}
