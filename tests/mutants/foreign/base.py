"""A mutant: a component that is wrong on purpose, beside the right one whose parameters it takes."""

from __future__ import annotations

import copy
import inspect
import typing
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import attrs

import vedette

Label = Literal["wrong", "other_model"]

ROLES: dict[str, type] = {
    "motion": vedette.MotionModel,
    "imaging": vedette.ImagingSensor,
    "sensor": vedette.Sensor,
    "associator": vedette.Associator,
    "estimator": vedette.Estimator,
    "birth": vedette.Birth,
    "lifecycle": vedette.Lifecycle,
    "preprocessor": vedette.Preprocessor,
    "source": vedette.Source,
}
"""Role to what its components derive from."""

INHERITED: Any = object()
"""Instead of a method: neither the right component's nor a broken one, but that of the role."""


@attrs.frozen
class Mutant:
    """One sentence, `fault`, says what is wrong; `other_model` is wrong for the name but a model in its own right."""

    name: str
    role: str
    fault: str
    right: Callable[[], Any]
    make: Callable[[], Any]
    label: Label = "wrong"


def _is_property(role: type, name: str) -> bool:
    return isinstance(inspect.getattr_static(role, name), property)


def _delegate(role: type, name: str) -> Any:
    if _is_property(role, name):
        return property(lambda self: getattr(self._right, name))
    return lambda self, *args, **more: getattr(self._right, name)(*args, **more)


def _broken(role: type, name: str, fault: Any) -> Any:
    if not callable(fault):  # a declaration, such as `divisible`
        return fault
    if _is_property(role, name):
        return property(lambda self: fault(self._right))
    return lambda self, *args, **more: fault(self._right, *args, **more)


def _placing(place: Callable[[Any, Any], Any]) -> Any:
    """Return an `at` that gives the mutant as placed: it is wrong there, too."""

    def at(self: Any, pose: Any) -> Any:
        there = place(self._right, pose)
        clone = copy.copy(self)
        for field in attrs.fields(type(self)):
            object.__setattr__(clone, field.name, there if field.name == "_right" else getattr(there, field.name))
        return clone

    return at


def broken_class(role: type, right: type, name: str, faults: dict[str, Any]) -> type:
    """Return a component with the parameters of `right` that does what `right` does, but for `faults`.

    A fault is the value of a declaration, or a function of the right component and of the method's arguments. The right
    component's compiled twin is not the mutant's: a filter that goes through it would not meet the fault.
    """
    faults = {"twin": INHERITED, **faults} if hasattr(role, "twin") else faults
    body: dict[str, Any] = {"kind": f"foreign_{name}", "__doc__": f"The mutant {name}.", "__module__": __name__}
    for member in dir(role):
        if member.startswith("_") or member == "kind" or member in {f.name for f in attrs.fields(right) if f.init}:
            continue
        if member in faults:
            if faults[member] is not INHERITED:
                body[member] = _placing(faults[member]) if member == "at" else _broken(role, member, faults[member])
        elif callable(getattr(role, member)) or _is_property(role, member):
            if inspect.getattr_static(right, member, None) is not inspect.getattr_static(role, member):
                body[member] = _placing(right.at) if member == "at" else _delegate(role, member)
        else:
            body[member] = getattr(right, member)
    if unknown := [member for member in faults if member not in body and faults[member] is not INHERITED]:
        raise ValueError(f"{name}: no such method: {unknown}")
    hints = typing.get_type_hints(right)
    parameters = {
        f.name: attrs.field(
            default=f.default,
            validator=f.validator,
            converter=f.converter,
            metadata=f.metadata,
            type=hints.get(f.name, f.type),
            kw_only=f.kw_only,
            alias=f.alias,
            eq=f.eq_key or f.eq,
            repr=f.repr,
        )
        for f in attrs.fields(right)
        if f.init
    }
    body |= {parameter: None for parameter in parameters if hasattr(role, parameter)}  # the field is no longer abstract
    aliases = {f.name: f.alias for f in attrs.fields(right) if f.init}

    def inner(self: Any) -> Any:
        return right(**{alias: getattr(self, field) for field, alias in aliases.items()})

    hidden = attrs.field(init=False, repr=False, eq=False, default=attrs.Factory(inner, takes_self=True))
    made = attrs.make_class(
        "".join(part.title() for part in name.split("_")),
        {**parameters, "_right": hidden},
        bases=(role,),
        class_body=body,
        frozen=True,
        slots=False,
    )
    globals()[made.__name__] = made  # found by its name, as by pickle
    return typing.cast(type, made)


def mutant(role: str, name: str, fault: str, right: partial[Any], label: Label = "wrong", **faults: Any) -> Mutant:
    """Return the mutant of `right`, a shipped component's class with its parameters, that has these faulty members."""
    return Mutant(
        name, role, fault, right, partial(broken_class(ROLES[role], right.func, name, faults), **right.keywords), label
    )
