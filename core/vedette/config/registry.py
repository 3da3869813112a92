"""What is installed: the components of every plugin, by role and kind. A registry is a value; tests pass their own."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Self

from attrs import Factory, field, frozen

from vedette.config.contract import Installed, described
from vedette.config.parameters import ROLES
from vedette.config.plugins import SetAside, load_plugins
from vedette.config.suggestions import did_you_mean, which_kind
from vedette.errors import ConfigError, PluginError
from vedette.roles import Component


@frozen
class Clash:
    """A kind that several distributions provide, so that none of them is used."""

    role: str
    kind: str
    entries: tuple[Installed, ...]

    def __str__(self) -> str:
        bringers = " and by ".join(entry.bringer for entry in self.entries)
        count = "neither" if len(self.entries) == 2 else "none"
        return (
            f"the {self.role} kind {self.kind!r} is brought by {bringers}, so {count} is used; "
            "rename one, or uninstall its distribution"
        )


def choice_of(candidates: Iterable[Installed]) -> str:
    """Return the kinds to choose from, in words."""
    kinds = ", ".join(entry.kind for entry in candidates)
    return f"installed: {kinds}" if kinds else "none is installed"


def _in_order(entries: Iterable[Installed]) -> tuple[Installed, ...]:
    roles = list(ROLES)
    return tuple(sorted(entries, key=lambda entry: (roles.index(entry.role), entry.kind)))


def _by_kind(registry: Registry) -> Mapping[tuple[str, str], Installed]:
    unique, clashes = _unambiguous(registry.entries)
    if clashes:
        raise PluginError(str(clashes[0]))
    return MappingProxyType({(entry.role, entry.kind): entry for entry in unique})


def _unambiguous(entries: Iterable[Installed]) -> tuple[tuple[Installed, ...], tuple[Clash, ...]]:
    """Return the entries whose kind is unique, and the kinds that several provide; one class may come twice."""
    classes: dict[tuple[str, str], dict[type[Component], Installed]] = {}
    for entry in entries:
        classes.setdefault((entry.role, entry.kind), {}).setdefault(entry.cls, entry)
    groups = [(role, kind, tuple(group.values())) for (role, kind), group in classes.items()]
    unique = tuple(group[0] for *_, group in groups if len(group) == 1)
    return unique, tuple(Clash(*several) for several in groups if len(several[-1]) > 1)


@frozen
class Registry:
    """Components by role and kind, in the order of the roles and then of the kinds' names; and what is not used, and why."""

    entries: tuple[Installed, ...] = field(default=(), converter=_in_order)
    broken: tuple[SetAside, ...] = ()
    clashes: tuple[Clash, ...] = ()
    _index: Mapping[tuple[str, str], Installed] = field(
        init=False, repr=False, eq=False, default=Factory(_by_kind, takes_self=True)
    )

    @classmethod
    def of(cls, *classes: type[Component]) -> Self:
        """Return a registry of exactly these component classes; PluginError if one of them breaks the contract."""
        return cls(tuple(described(component, "given here", "") for component in classes))

    @classmethod
    def installed(cls) -> Self:
        """Return everything that the entry points of the group `vedette` provide.

        A plugin that cannot be imported or breaks the contract is kept in `broken` with its reason, and a kind that two
        provide in `clashes`: neither stops the others.
        """
        plugins, broken = load_plugins()
        entries, clashes = _unambiguous(entry for plugin in plugins for entry in plugin.entries)
        return cls(entries, broken, clashes)

    def __iter__(self) -> Iterator[Installed]:
        return iter(self.entries)

    def of_role(self, role: str) -> tuple[Installed, ...]:
        """Return all components of a role; ConfigError if there is no such role."""
        if role not in ROLES:
            raise ConfigError.at(role, f"is not a role;{did_you_mean(role, ROLES)} the roles are {', '.join(ROLES)}")
        return tuple(entry for entry in self.entries if entry.role == role)

    def find(self, role: str, kind: str) -> Installed | None:
        """Return the component of that role and kind, or None."""
        return self._index.get((role, kind))

    def get(self, role: str, kind: str) -> Installed:
        """Return the component of that role and kind; ConfigError says why there is none, and what there is instead."""
        entry = self.find(role, kind)
        if entry is None:
            raise ConfigError.at(role, self.unknown(role, kind, self.of_role(role)))
        return entry

    def unused(self, kind: str, roles: Iterable[str] = ROLES) -> list[str]:
        """Return why a kind of one of the roles is installed but unused: several provide it, or its plugin is set aside."""
        roles = list(roles)
        clashes = [str(clash) for clash in self.clashes if clash.kind == kind and clash.role in roles]
        return clashes + [str(plugin) for plugin in self.broken if any(plugin.brings(role, kind) for role in roles)]

    def reasons(self) -> list[str]:
        """Return why anything that is installed is not used."""
        return [*map(str, self.broken), *map(str, self.clashes)]

    def unreadable(self) -> list[str]:
        """Return what is wrong with the plugins whose kinds are unknown."""
        return [str(plugin) for plugin in self.broken if plugin.kinds is None]

    def unknown(self, role: str, kind: str, candidates: Iterable[Installed]) -> str:
        """Return why `kind` is not among the candidates of a role, and what may have been meant; causes before lists."""
        if unused := self.unused(kind, [role]):
            return "; ".join(unused)
        offered = [*candidates]
        elsewhere = [entry.role for entry in self.entries if entry.kind == kind]
        hint = f" it is a kind of {' and '.join(elsewhere)};" if elsewhere else which_kind(kind, offered)
        causes = "".join(f" {cause};" for cause in self.unreadable())
        shown = repr(kind) if len(kind) <= 60 else f"{kind[:57]!r}... of {len(kind):,} characters"
        return f"unknown kind {shown};{hint}{causes} {choice_of(offered)}"
