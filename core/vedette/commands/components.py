"""`vedette components`: what is installed, with its parameters."""

from __future__ import annotations

import json
from argparse import Namespace
from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import Any

from vedette.config.contract import Installed
from vedette.config.parameters import Parameter, parameters, tables
from vedette.config.registry import Registry

_SIGNS = {"above": ">", "at_least": ">=", "below": "<", "at_most": "<="}


def run(arguments: Namespace) -> int:
    """Print them by role, as text or as JSON."""
    registry = Registry.installed()
    entries = registry.entries if arguments.role is None else registry.of_role(arguments.role)
    if arguments.json:
        found = {"components": [_described(entry) for entry in entries], **_unused(registry)}
        print(json.dumps(found, indent=2))
        return 0
    for line in _listing([entry for entry in entries if not entry.cls.misprint]):
        print(line)
    shown = [entry for entry in entries if entry.cls.misprint]
    if shown:
        print("\nnot to be chosen: they only show what a paper prints")
        for entry in shown:
            print(f"\n  {entry.role} {entry.kind}  ({entry.distribution} {entry.version})".rstrip())
            for line in wrap(entry.cls.misprint, 110, initial_indent="    ", subsequent_indent="    "):
                print(line)
    for reason in registry.reasons():
        print(f"\nbroken: {reason}")
    return 0


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


def _takes(own: Sequence[Parameter], indent: str) -> Iterator[str]:
    width = max((len(parameter.name) for parameter in own), default=0)
    for parameter in own:
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
