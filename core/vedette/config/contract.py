"""What a component class must be."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from attrs import NOTHING, field, frozen
from attrs.exceptions import FrozenInstanceError

from vedette import display
from vedette.config.parameters import ROLES, Parameter, parameters, plain, role_of, tables
from vedette.errors import PluginError
from vedette.filters import contradiction
from vedette.roles import CONTRACT, Component

_KIND = re.compile(r"\w[\w.+-]*")
"""What configs and messages can name: nothing that splits a line, or that a terminal obeys."""


@frozen
class Installed:
    """A component class, its distribution, and its parameters."""

    role: str
    kind: str
    cls: type[Component]
    distribution: str
    version: str
    parameters: tuple[Parameter, ...] = field(repr=False)

    @property
    def summary(self) -> str:
        """The first line of the class's docstring."""
        return display.about(self.cls).partition("\n")[0]

    @property
    def bringer(self) -> str:
        """The distribution with its version, and the class."""
        return f"{f'{self.distribution} {self.version}'.strip()} ({self.cls.__module__}.{self.cls.__qualname__})"

    def describe(self) -> dict[str, Any]:
        """Return a full description as plain data, for listings."""
        contributions = {name: list(parts) for name, parts in self.contributions.items()}
        further = {"misprint": self.cls.misprint, "contributions": contributions}
        return {
            "role": self.role,
            "kind": self.kind,
            "distribution": self.distribution,
            "version": self.version,
            "summary": self.summary,
            "parameters": [parameter.describe() for parameter in self.parameters],
            **{name: value for name, value in further.items() if value},
        }

    @property
    def contributions(self) -> Mapping[str, tuple[str, ...]]:
        """What a reproduced paper contributes, and which components it is; empty for other roles."""
        elements = getattr(self.cls, "elements", ()) if self.role == "reproduction" else ()
        return {f"{element.what}, {element.where}": element.made_of for element in elements if element.made_of}


def check_version(module: Any) -> None:
    """Raise PluginError unless a plugin states that it is written for this version of the contract."""
    stated = getattr(module, "VEDETTE_CONTRACT", None)
    if stated is None:
        raise PluginError(
            f"it does not state the version of the contract that it is written for; this Vedette has {CONTRACT}: "
            f"once the plugin keeps that, write `VEDETTE_CONTRACT = {CONTRACT}` in {getattr(module, '__name__', module)}"
        )
    if stated != CONTRACT:
        raise PluginError(f"it is written for version {stated} of the contract; this Vedette has {CONTRACT}")


def described(cls: type[Component], distribution: str, version: str) -> Installed:
    """Check that a class can be built from a config; PluginError says what it lacks."""
    who = str(getattr(cls, "__qualname__", cls))
    if not isinstance(cls, type):
        raise PluginError(f"{who} is not a class")
    role = role_of(cls)
    if role is None:
        raise PluginError(f"{who} plays none of the roles {', '.join(ROLES)}; derive it from one of their classes")
    if missing := sorted(getattr(cls, "__abstractmethods__", ())):
        article = "an" if role[0] in "aeiou" else "a"
        raise PluginError(f"{who} is incomplete; {article} {role} must also define {', '.join(missing)}")
    if reason := contradiction(cls):
        raise PluginError(f"{who}: {reason}")
    if "__attrs_attrs__" not in vars(cls):
        raise PluginError(f"{who} is not an attrs class; decorate it with @attrs.frozen")
    if not _is_frozen(cls):
        raise PluginError(
            f"{who} is not frozen: its parameters could change under a tracker; decorate it with @attrs.frozen"
        )
    kind = getattr(cls, "kind", None)
    if not isinstance(kind, str) or not kind:
        raise PluginError(f"{who} has no `kind: ClassVar[str]`, the name that configs use")
    if not _KIND.fullmatch(kind):
        raise PluginError(f"{who}: its kind must be one word, as 'my_model': letters, digits and _ - . +, got {kind!r}")
    try:
        declared = parameters(cls)
        inner = tables(declared)
        for parameter in (*declared, *(parameter for table in inner for parameter in parameters(table))):
            _check_default(parameter)
    except TypeError as error:
        raise PluginError(f"{who}: {error}") from error
    if any(parameter.name == "kind" for parameter in declared):
        raise PluginError(f"{who}: `kind` must be a ClassVar, not a parameter")
    return Installed(role, kind, cls, distribution, version, declared)


def _check_default(parameter: Parameter) -> None:
    """Raise TypeError if a parameter has a default that no config could express: listings show it."""
    try:
        if parameter.default is not NOTHING:
            plain(parameter.default)
    except Exception as error:
        raise TypeError(f"{parameter.name}: its default cannot be told: {error}") from error


def _is_frozen(cls: type) -> bool:
    """Return whether attributes of an instance cannot be set, tested on one made without its constructor."""
    try:
        setattr(object.__new__(cls), "anything", None)  # noqa: B010
    except FrozenInstanceError:
        return True
    except (AttributeError, TypeError):
        return False
    return False
