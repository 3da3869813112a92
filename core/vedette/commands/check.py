"""`vedette check`: test the laws of a component's role on an installed component or on those of a module."""

from __future__ import annotations

import inspect
import json
from argparse import Namespace
from importlib import import_module
from types import ModuleType
from typing import Any

from vedette.commands.ending import DONE, FAILED, complain
from vedette.config.contract import described
from vedette.config.parameters import role_of
from vedette.config.registry import Registry
from vedette.config.suggestions import did_you_mean
from vedette.errors import ConfigError, PluginError, Problem
from vedette.roles import Component


def run(arguments: Namespace) -> int:
    """Print a table of laws for each component: held, failed with the smallest counterexample, skipped and why."""
    try:
        from vedette.testing.law import Profile

        profile = Profile.named(arguments.profile, arguments.seed)
        found = [check(cls, profile) for cls in classes_of(arguments.subject, Registry.installed())]
    except ModuleNotFoundError as missing:
        return complain(str(missing))
    if arguments.json:
        print(json.dumps({"components": found}))
    return FAILED if any(component["failed"] for component in found) else DONE


def classes_of(subject: str, registry: Registry) -> list[type[Component]]:
    """Return the components that a kind, a module, or `module:Class` names; ConfigError if there are none."""
    kinds = [entry.cls for entry in registry if subject == entry.kind]
    if kinds:
        return kinds
    if unused := registry.unused(subject):
        raise ConfigError([Problem(subject, reason) for reason in unused])
    name, _, one = subject.partition(":")
    try:
        module = import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not (name == error.name or name.startswith(f"{error.name}.")):
            raise PluginError(f"{name}: could not be imported: {error}") from error
        hints = did_you_mean(subject, [entry.kind for entry in registry])
        hints += "".join(f" {cause};" for cause in registry.unreadable())
        text = f"is neither an installed kind nor a module;{hints} `vedette components` lists the kinds"
        raise ConfigError([Problem(subject, text)]) from None
    except Exception as error:
        raise PluginError(f"{name}: could not be imported: {type(error).__name__}: {error}") from error
    found = _components(module)
    if one:
        found = [cls for cls in found if cls.__name__ == one]
    if not found:
        raise ConfigError([Problem(subject, "has no component: no class derived from a role, with a kind")])
    return found


def _components(module: ModuleType) -> list[type[Component]]:
    """Return what the module's hook brings; without a hook, the complete components that are written in it."""
    hook = getattr(module, "vedette_components", None)
    if callable(hook):
        try:
            return list(hook())
        except Exception as error:
            raise PluginError(
                f"{module.__name__}: its vedette_components failed: {type(error).__name__}: {error}"
            ) from error
    own = [cls for _, cls in inspect.getmembers(module, inspect.isclass) if cls.__module__ == module.__name__]
    return [cls for cls in own if issubclass(cls, Component) and role_of(cls) and not inspect.isabstract(cls)]


def check(cls: type[Component], profile: object) -> dict[str, Any]:
    """Print the table of one component, and return it as plain data."""
    from vedette.testing.kit import examine, laws_of
    from vedette.testing.law import Profile
    from vedette.testing.strategies import components

    assert isinstance(profile, Profile)
    entry, laws = described(cls, "", ""), laws_of(cls)
    name = f"{cls.__module__}.{cls.__qualname__}"
    print(f"{entry.role} {entry.kind} ({name})")
    told: list[dict[str, Any]] = []
    component = {"role": entry.role, "kind": entry.kind, "class": name, "failed": True, "laws": told}
    try:
        drawn = components(cls)
    except ValueError as lacking:
        print(f"  cannot be drawn: {lacking}\n  write a test with `conformance({cls.__name__}, ...)` that gives it")
        return component | {"reason": str(lacking)}
    width = max(len(law.name) for law in laws)
    for law in laws:
        outcome = examine(cls, law, drawn, profile)
        told.append({"law": law.name, "verdict": outcome.verdict, "text": outcome.text, "examples": outcome.examples})
        note = law.sentence if outcome.verdict == "held" else outcome.text.replace("\n", "\n" + " " * (width + 12))
        print(f"  {law.name:{width}}  {outcome.verdict:7} {note}", flush=True)
    return component | {"failed": any(law["verdict"] == "failed" for law in told)}
