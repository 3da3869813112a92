"""`vedette components`: what is installed, with its parameters."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from textwrap import shorten, wrap
from typing import Any

from vedette import ConfigError, Experiment, Problem, Registry, Tracker, display
from vedette.config import Installed, did_you_mean, which_kind
from vedette.config.parameters import APART, ROLES, Parameter, Table, parameters, tables

_WIDTH = 120
_NOT_CHOSEN = "not to be chosen: they only show what a paper prints"
_SIGNS = {"above": ">", "at_least": ">=", "below": "<", "at_most": "<="}


def run(arguments: Namespace) -> int:
    """Print them by role, as text or as JSON: a line for each kind, or all of a role or of a kind."""
    registry, wanted = Registry.installed(), arguments.wanted
    if arguments.json:
        listed = {"components": [_described(entry) for entry in _chosen(registry, wanted)], **_unused(registry)}
        print(json.dumps(listed, indent=2))
        return 0
    plain = _top_tables()
    if wanted is None:
        shown = list(_overview(registry.entries, plain))
    elif wanted in plain:
        shown = [f"{wanted}: {_summary(plain[wanted])}", "", *_takes(parameters(plain[wanted]), "  ")]
    else:
        entries = _chosen(registry, wanted)
        shown = [*_listing([entry for entry in entries if not entry.cls.misprint]), *_misprints(entries)]
    for line in (*shown, *(f"\nbroken: {reason}" for reason in registry.reasons())):
        print(line)
    return 0


def _chosen(registry: Registry, wanted: str | None) -> tuple[Installed, ...]:
    """Return all components, those of a role, or those of a kind; ConfigError if `wanted` is neither."""
    if wanted is None:
        return registry.entries
    if wanted in ROLES:
        return registry.of_role(wanted)
    if of_kind := tuple(entry for entry in registry.entries if entry.kind == wanted):
        return of_kind
    if unused := registry.unused(wanted):
        raise ConfigError([Problem(wanted, reason) for reason in unused])
    question = did_you_mean(wanted, [*ROLES, *_top_tables()]) or which_kind(wanted, registry.entries)
    causes = "".join(f" {cause};" for cause in registry.unreadable())
    text = (
        f"is no role and no kind;{question}{causes} the roles are {', '.join(ROLES)}; `vedette components` lists the kinds"
    )
    raise ConfigError.at(wanted, text)


def _top_tables() -> dict[str, type]:
    """Return the tables without a kind at the top of a config: gate, judge."""
    top = (*parameters(Tracker), *parameters(Experiment))
    return {p.name: p.shape.cls for p in top if isinstance(p.shape, Table) and p.shape.cls is not Tracker}


def _summary(cls: type) -> str:
    return display.about(cls).partition("\n")[0]


def _overview(entries: Sequence[Installed], plain: Mapping[str, type]) -> Iterator[str]:
    """Yield a line for each kind, then the tables without kinds; kinds that only studies need come last."""
    usual = [entry for entry in entries if not entry.cls.misprint and entry.role not in APART]
    for role in dict.fromkeys(entry.role for entry in usual):
        yield role
        yield from (_line(entry.kind, _titled(entry)) for entry in usual if entry.role == role)
        yield ""
    yield "tables"
    yield from (_line(name, _summary(cls)) for name, cls in plain.items())
    yield ""
    for role, told in zip(APART, ("studies to reproduce", "commands", "pictures"), strict=True):
        if kinds := [entry.kind for entry in entries if entry.role == role]:
            yield from wrap(f"{told}: {', '.join(kinds)}", _WIDTH, subsequent_indent="  ")
    apart = [f"{entry.role} {entry.kind}" for entry in entries if entry.cls.misprint]
    if apart:
        yield from wrap(f"{_NOT_CHOSEN}: {', '.join(apart)}", _WIDTH, subsequent_indent="  ")
    yield ""
    yield "more: vedette components ROLE, KIND, gate or judge"


def _titled(entry: Installed) -> str:
    foreign = "" if entry.distribution == "vedette" else f" ({entry.distribution} {entry.version})"
    return entry.summary + foreign


def _line(name: str, text: str) -> str:
    return f"  {name:<31} " + shorten(text, _WIDTH - 34, placeholder=" ...")


def _misprints(entries: Sequence[Installed]) -> Iterator[str]:
    shown = [entry for entry in entries if entry.cls.misprint]
    if shown:
        yield f"\n{_NOT_CHOSEN}"
        for entry in shown:
            yield f"\n  {entry.role} {entry.kind}  ({entry.distribution} {entry.version})".rstrip()
            yield from wrap(entry.cls.misprint, 110, initial_indent="    ", subsequent_indent="    ")


def _unused(registry: Registry) -> dict[str, Any]:
    """Return what is installed but not used, as plain data."""
    return {
        "broken": [
            {"distribution": plugin.distribution, "entry_point": plugin.entry_point, "error": plugin.error}
            for plugin in registry.broken
        ],
        "clashes": [
            {"role": clash.role, "kind": clash.kind, "bringers": [entry.bringer for entry in clash.entries]}
            for clash in registry.clashes
        ],
    }


def _described(entry: Installed) -> dict[str, Any]:
    """Return a component as plain data, with the tables among its parameters, nested ones included."""
    inner = {cls.__name__: [parameter.describe() for parameter in parameters(cls)] for cls in tables(entry.parameters)}
    return entry.describe() | {"tables": inner}


def _listing(entries: Sequence[Installed]) -> Iterator[str]:
    role = ""
    for entry in entries:
        if entry.role != role:
            role = entry.role
            yield from ([] if entry is entries[0] else [""])
            yield role
        yield ""
        yield f"  {entry.kind}  ({entry.distribution} {entry.version})".rstrip()
        yield from wrap(entry.summary, 110, initial_indent="    ", subsequent_indent="    ")
        for what, parts in entry.contributions.items():
            yield from wrap(f"{what}: {', '.join(parts)}", 110, initial_indent="      ", subsequent_indent="        ")
        yield from _takes(entry.parameters, "      ")
        for cls in tables(entry.parameters):
            yield f"      table {cls.__name__}:"
            yield from _takes(parameters(cls), "        ")
    if not entries:
        yield "none is installed"


def _takes(declared: Sequence[Parameter], indent: str) -> Iterator[str]:
    width = max((len(parameter.name) for parameter in declared), default=0)
    for parameter in declared:
        about = parameter.describe()
        facts = [about["type"], "" if about["unit"] in ("", "1") else f"in {about['unit']}", *_range(about)]
        facts.append("required" if about["required"] else f"default {_shown(about.get('default'))}")
        head = f"{indent}{parameter.name:<{width}}  "
        text = f"{', '.join(filter(None, facts))}: {about['doc']}"
        yield from wrap(text, 120, initial_indent=head, subsequent_indent=" " * len(head))


def _range(about: dict[str, Any]) -> list[str]:
    bounds = [f"{_SIGNS[name]} {bound:g}" for name, bound in about.get("limits", {}).items()]
    return [*bounds, *(["one of " + ", ".join(map(repr, about["options"]))] if "options" in about else [])]


def _shown(value: Any) -> str:
    if value is None:
        return "none"
    return json.dumps(value)
