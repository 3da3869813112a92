"""What is installed: the components of every plugin, by role and kind. A registry is a value; tests pass their own."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Self

from attrs import Factory, field, frozen

from vedette.config.parameters import ROLES, Parameter, parameters, role_of, tables
from vedette.errors import ConfigError, PluginError, Problem
from vedette.filters.declared import contradiction
from vedette.roles import CONTRACT, Component

if TYPE_CHECKING:
    from importlib.metadata import Distribution, EntryPoint

GROUP = "vedette"
"""The entry point group, and the name of the pluggy project."""


@frozen
class Installed:
    """A component class, who brought it, and what it takes."""

    role: str
    kind: str
    cls: type[Component]
    distribution: str
    version: str
    parameters: tuple[Parameter, ...] = field(repr=False)

    @property
    def summary(self) -> str:
        """The first line of the class's docstring."""
        return inspect.cleandoc(self.cls.__doc__ or "").partition("\n")[0]

    @property
    def bringer(self) -> str:
        """The distribution with its version, and the class."""
        return f"{f'{self.distribution} {self.version}'.strip()} ({self.cls.__module__}.{self.cls.__qualname__})"

    def describe(self) -> dict[str, Any]:
        """All about it as plain data, for listings."""
        return {
            "role": self.role,
            "kind": self.kind,
            "distribution": self.distribution,
            "version": self.version,
            "summary": self.summary,
            "parameters": [parameter.describe() for parameter in self.parameters],
        }


@frozen
class BrokenPlugin:
    """A plugin that could not be loaded: told when somebody asks for a kind that is missing."""

    distribution: str
    entry_point: str
    error: str

    def __str__(self) -> str:
        return f"plugin {self.entry_point!r} of {self.distribution} could not be imported: {self.error}"


def _in_order(entries: Iterable[Installed]) -> tuple[Installed, ...]:
    roles = list(ROLES)
    return tuple(sorted(entries, key=lambda entry: (roles.index(entry.role), entry.kind)))


def _by_kind(registry: Registry) -> Mapping[tuple[str, str], Installed]:
    found: dict[tuple[str, str], Installed] = {}
    for entry in registry.entries:
        other = found.setdefault((entry.role, entry.kind), entry)
        if other is not entry:
            raise PluginError(
                f"the {entry.role} kind {entry.kind!r} is taken twice: by {other.bringer} and by {entry.bringer}; "
                "rename one, or uninstall its distribution"
            )
    return MappingProxyType(found)


@frozen
class Registry:
    """Components by role and kind, in the order of the roles and then of the kinds' names."""

    entries: tuple[Installed, ...] = field(default=(), converter=_in_order)
    broken: tuple[BrokenPlugin, ...] = ()
    _index: Mapping[tuple[str, str], Installed] = field(
        init=False, repr=False, eq=False, default=Factory(_by_kind, takes_self=True)
    )

    @classmethod
    def of(cls, *classes: type[Component]) -> Self:
        """Exactly these component classes."""
        return cls(tuple(_installed(component, "given here", "") for component in classes))

    @classmethod
    def installed(cls) -> Self:
        """Everything that the entry points of the group `vedette` bring.

        A plugin that cannot be imported is kept in `broken` and harms no other. One that breaks the contract raises
        PluginError: a kind that is taken, a class that is incomplete or of no role, another version of the contract.
        """
        from importlib.metadata import entry_points

        entries: list[Installed] = []
        broken: list[BrokenPlugin] = []
        points = entry_points(group=GROUP)
        owners = {id(dist): _owner(dist) for dist in {id(point.dist): point.dist for point in points}.values()}
        for point in sorted(points, key=lambda point: (owners[id(point.dist)], point.name)):
            name, version = owners[id(point.dist)]
            try:
                classes = _components(point, f"{name} {version}")
            except PluginError:
                raise
            except (Exception, SystemExit) as error:
                broken.append(BrokenPlugin(f"{name} {version}", point.name, f"{type(error).__name__}: {error}"))
            else:
                entries += [_installed(component, name, version) for component in classes]
        return cls(tuple(entries), tuple(broken))

    def __iter__(self) -> Iterator[Installed]:
        return iter(self.entries)

    def of_role(self, role: str) -> tuple[Installed, ...]:
        """All components of a role; ConfigError if there is no such role."""
        if role not in ROLES:
            raise ConfigError([Problem(role, f"is not a role;{did_you_mean(role, ROLES)} the roles are {', '.join(ROLES)}")])
        return tuple(entry for entry in self.entries if entry.role == role)

    def find(self, role: str, kind: str) -> Installed | None:
        """The component of that role and kind, or None."""
        return self._index.get((role, kind))

    def get(self, role: str, kind: str) -> Installed:
        """The component of that role and kind; ConfigError says what there is instead."""
        entry = self.find(role, kind)
        if entry is None:
            raise ConfigError([Problem(role, self.unknown(kind, self.of_role(role)))])
        return entry

    def unknown(self, kind: str, candidates: Iterable[Installed]) -> str:
        """Why `kind` is not among the candidates, and what may have been meant."""
        kinds = [entry.kind for entry in candidates]
        elsewhere = [entry.role for entry in self.entries if entry.kind == kind]
        hint = f" it is a kind of {' and '.join(elsewhere)};" if elsewhere else did_you_mean(kind, kinds)
        known = f"installed: {', '.join(kinds)}" if kinds else "none is installed"
        return "; ".join([f"unknown kind {kind!r};{hint} {known}", *map(str, self.broken)])


def nearest(given: str, known: Iterable[str]) -> str | None:
    """The known name that `given` was probably meant to be, or None."""
    from difflib import get_close_matches

    known = list(known)
    near = get_close_matches(given, known, n=1) or [name for name in known if name.startswith(f"{given}_")]
    return next(iter(near), None)


def did_you_mean(given: str, known: Iterable[str]) -> str:
    """The question after a name that is not known, led by a space; nothing if no known name is near."""
    near = nearest(given, known)
    return f" did you mean {near!r}?" if near else ""


def _owner(dist: Distribution | None) -> tuple[str, str]:
    """Name and version of a distribution."""
    if dist is None:
        return "an unnamed distribution", ""
    metadata = dist.metadata  # parsed anew each time that it is asked for
    return metadata["Name"], metadata["Version"]


def _components(point: EntryPoint, owner: str) -> list[type[Component]]:
    """Import one plugin and call its hook. Whatever its own code raises is passed on; PluginError is the contract's."""
    import pluggy

    from vedette.config import hooks

    who = f"plugin {point.name!r} of {owner}"
    module = point.load()
    stated = getattr(module, "VEDETTE_CONTRACT", CONTRACT)
    if stated != CONTRACT:
        raise PluginError(f"{who}: is written for version {stated} of the contract; this Vedette has {CONTRACT}")
    manager = pluggy.PluginManager(GROUP)
    manager.add_hookspecs(hooks)
    try:
        manager.register(module)
    except pluggy.PluginValidationError as error:
        raise PluginError(f"{who}: its hook does not fit: {error}") from error
    if not manager.hook.vedette_components.get_hookimpls():
        raise PluginError(f"{who}: {point.value} has no function `vedette_components` marked with @vedette.plugin")
    return [component for brought in manager.hook.vedette_components() for component in brought]


def _installed(cls: type[Component], distribution: str, version: str) -> Installed:
    """Check that a class can be built from a config; PluginError says what it lacks."""
    who = f"{getattr(cls, '__qualname__', cls)!s} of {distribution} {version}".strip()
    if not isinstance(cls, type):
        raise PluginError(f"{who}: is not a class")
    role = role_of(cls)
    if role is None:
        raise PluginError(f"{who}: plays none of the roles {', '.join(ROLES)}; derive it from one of their classes")
    if missing := sorted(getattr(cls, "__abstractmethods__", ())):
        raise PluginError(f"{who}: is incomplete; a {role} must also define {', '.join(missing)}")
    if reason := contradiction(cls):
        raise PluginError(f"{who}: {reason}")
    if "__attrs_attrs__" not in vars(cls):
        raise PluginError(f"{who}: is not an attrs class; decorate it with @attrs.frozen")
    kind = getattr(cls, "kind", None)
    if not isinstance(kind, str) or not kind:
        raise PluginError(f"{who}: has no `kind: ClassVar[str]`, the name that configs use")
    try:
        own = parameters(cls)
        tables(own)
    except TypeError as error:
        raise PluginError(f"{who}: {error}") from error
    if any(parameter.name == "kind" for parameter in own):
        raise PluginError(f"{who}: `kind` must be a ClassVar, not a parameter")
    return Installed(role, kind, cls, distribution, version, own)
