"""`vedette check`: the laws of a component's role, tried on an installed component or on those of a module."""

from __future__ import annotations

import inspect
from argparse import Namespace
from importlib import import_module
from types import ModuleType

from vedette.commands.ending import DONE, FAILED, complain
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
    return FAILED if any(found) else DONE


def classes_of(subject: str, registry: Registry) -> list[type[Component]]:
    """The components that a kind, a module, or `module:Class` names; ConfigError if there are none."""
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
            raise PluginError(f"{name}: cannot be imported: {error}") from error
        hints = did_you_mean(subject, [entry.kind for entry in registry])
        hints += "".join(f" {cause};" for cause in registry.unreadable())
        text = f"is neither an installed kind nor a module;{hints} `vedette components` lists the kinds"
        raise ConfigError([Problem(subject, text)]) from None
    found = _components(module)
    if one:
        found = [cls for cls in found if cls.__name__ == one]
    if not found:
        raise ConfigError([Problem(subject, "has no component: no class derived from a role, with a kind")])
    return found


def _components(module: ModuleType) -> list[type[Component]]:
    """What the module's hook brings; without a hook, the complete components that are written in it."""
    hook = getattr(module, "vedette_components", None)
    if callable(hook):
        return list(hook())
    own = [cls for _, cls in inspect.getmembers(module, inspect.isclass) if cls.__module__ == module.__name__]
    return [cls for cls in own if issubclass(cls, Component) and role_of(cls) and not inspect.isabstract(cls)]


def check(cls: type[Component], profile: object) -> bool:
    """Print the table of one component; True if a law failed."""
    from vedette.testing.kit import examine, laws_of
    from vedette.testing.law import Profile
    from vedette.testing.strategies import components

    assert isinstance(profile, Profile)
    laws = laws_of(cls)
    print(f"{role_of(cls)} {cls.kind} ({cls.__module__}.{cls.__qualname__})")
    try:
        drawn = components(cls)
    except ValueError as lacking:
        print(f"  cannot be drawn: {lacking}\n  write a test with `conformance({cls.__name__}, ...)` that gives it")
        return True
    width = max(len(law.name) for law in laws)
    failed = False
    for law in laws:
        outcome = examine(cls, law, drawn, profile)
        failed = failed or outcome.verdict == "failed"
        note = law.sentence if outcome.verdict == "held" else outcome.text.replace("\n", "\n" + " " * (width + 12))
        print(f"  {law.name:{width}}  {outcome.verdict:7} {note}", flush=True)
    return failed
