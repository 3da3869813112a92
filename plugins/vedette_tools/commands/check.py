"""`vedette check`: test the laws of a component's role on an installed kind, on those of a module, or on a config's."""

from __future__ import annotations

import inspect
import json
import sys
import warnings
from argparse import Namespace
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

import attrs

from vedette import Component, ConfigError, PluginError, Problem, Registry, load
from vedette.commands import DONE, FAILED, UNTRIED, complain
from vedette.config import described, did_you_mean
from vedette.config.parameters import role_of

FORMATS = (".toml", ".yaml", ".yml", ".json")
MOST_WARNINGS = 3
"""Different warnings that are shown."""

_CURE = "check it as it is configured, `vedette check KIND --config FILE`, or write a test with `conformance(...)`"


def run(arguments: Namespace) -> int:
    """Print a table of laws for each component: held, failed with the smallest counterexample, skipped and why."""
    try:
        from vedette.testing import Profile

        profile = Profile.named(arguments.profile, arguments.seed)
        if arguments.seconds is not None:
            profile = attrs.evolve(profile, seconds=arguments.seconds)
        only = {arguments.law: arguments.replay} if arguments.law else {}
        if arguments.replay and not only:
            raise ConfigError.at("--replay", "repeats an example of one law: name it, as in --law pure")
        if Path(arguments.subject).suffix in FORMATS:
            parts = parts_of(arguments.subject, None, arguments.overrides)
            tables = [check(type(part), profile, part, only) for part in parts]
        elif arguments.config is not None:
            parts = parts_of(arguments.config, arguments.subject, arguments.overrides)
            tables = [check(type(part), profile, part, only) for part in parts]
        elif arguments.overrides:
            raise ConfigError.at("--set", "changes a config: name one, as in --config tracker.toml")
        else:
            classes = classes_of(arguments.subject, Registry.installed())
            tables = [check(cls, profile, None, only) for cls in classes]
    except ModuleNotFoundError as missing:
        return complain(str(missing))
    if arguments.json:
        print(json.dumps({"components": tables}))
    if any(component["failed"] for component in tables):
        return FAILED
    return DONE if all(component["tried"] for component in tables) else UNTRIED


def parts_of(config: str, kind: str | None = None, overrides: Sequence[str] = ()) -> list[Component]:
    """Return the components of a config, or those of one kind, each with its parameters; ConfigError if there are none."""
    components: list[Component] = []

    def gather(value: Any) -> None:
        if isinstance(value, Component) and value not in components:
            components.append(value)
        if attrs.has(type(value)):
            for field in attrs.fields(type(value)):
                gather(getattr(value, field.name))
        elif isinstance(value, Mapping):
            for item in value.values():
                gather(item)
        elif isinstance(value, tuple | list):
            for item in value:
                gather(item)

    gather(load(config, overrides=overrides))
    parts = [part for part in components if role_of(type(part)) and kind in (None, part.kind)]
    if not parts:
        kinds = ", ".join(sorted({part.kind for part in components}))
        raise ConfigError.at(str(kind), f"{config} has none; it has {kinds}")
    return parts


def classes_of(subject: str, registry: Registry) -> list[type[Component]]:
    """Return the components that a kind, a module, or `module:Class` names; ConfigError if there are none."""
    kinds = [entry.cls for entry in registry if subject == entry.kind]
    if kinds:
        return kinds
    if unused := registry.unused(subject):
        raise ConfigError([Problem(subject, reason) for reason in unused])
    name, _, one = subject.partition(":")
    if (here := str(Path.cwd())) not in sys.path:
        sys.path.append(here)  # behind all that is installed
    try:
        module = import_module(name)
    except ModuleNotFoundError as error:
        if error.name is None or not (name == error.name or name.startswith(f"{error.name}.")):
            raise PluginError(f"{name}: could not be imported: {error}") from error
        hints = did_you_mean(subject, [entry.kind for entry in registry])
        hints += "".join(f" {cause};" for cause in registry.unreadable())
        text = f"is neither an installed kind nor a module;{hints} `vedette components` lists the kinds"
        raise ConfigError.at(subject, text) from None
    except (Exception, SystemExit) as error:
        raise PluginError(f"{name}: could not be imported: {type(error).__name__}: {error}") from error
    classes = _components(module)
    if one:
        classes = [cls for cls in classes if cls.__name__ == one]
    if not classes:
        raise ConfigError.at(subject, "has no component: no class derived from a role, with a kind")
    return classes


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
    defined = [cls for _, cls in inspect.getmembers(module, inspect.isclass) if cls.__module__ == module.__name__]
    return [cls for cls in defined if issubclass(cls, Component) and role_of(cls) and not inspect.isabstract(cls)]


def check(
    cls: type[Component], profile: object, one: Component | None = None, only: Mapping[str, str] = MappingProxyType({})
) -> dict[str, Any]:
    """Print the table of a class of components, or of `one` with its parameters, and return it as plain data.

    `only` holds the laws that are tried, if not all, and what repeats an example of each, or "".
    """
    from vedette.testing import Misuse, Profile, components, laws_of, own_laws

    assert isinstance(profile, Profile)
    from hypothesis.strategies import just  # which is there, as the kit is

    entry = described(cls, "", "")
    laws = _those(laws_of(cls), only, entry.role)
    name = f"{cls.__module__}.{cls.__qualname__}"
    print(f"{entry.role} {entry.kind} ({name})")
    told: list[dict[str, Any]] = []
    wanted: dict[str, None] = {}
    component = {"role": entry.role, "kind": entry.kind, "class": name, "failed": True, "tried": False, "laws": told}
    try:
        drawn = components(cls) if one is None else just(one)
    except ValueError as lacking:
        print(f"  cannot be drawn: {lacking}\n  {_CURE}")
        return component | {"reason": str(lacking)}
    width = max(len(law.name) for law in laws)
    warned: Counter[str] = Counter()
    for law in laws:
        try:
            outcome = _tried(cls, law, drawn, profile, only.get(law.name, ""), warned)
        except Misuse as lacking:
            if only.get(law.name):
                raise ConfigError.at("--replay", str(lacking).removeprefix("replay: ")) from None
            print(f"  cannot be drawn: {lacking}\n  {_CURE}")
            return component | {"reason": str(lacking)}
        if outcome.lacks:
            wanted[outcome.lacks] = None
        verdict, text = _expected(outcome.verdict, outcome.text, cls.known_failures.get(law.name))
        told.append(
            {"law": law.name, "verdict": verdict, "text": text, "examples": outcome.examples, "replay": outcome.replay}
        )
        if verdict == "failed" and outcome.replay:
            text += f"\nrepeat it with --law {law.name} --replay {outcome.replay}"
        note = law.sentence if verdict == "held" else text.replace("\n", "\n" + " " * (width + 12))
        print(f"  {law.name:{width}}  {verdict:7} {note}", flush=True)
    _tell_beside(wanted, warned)
    tried = _tell_counts(told, *own_laws(cls), all_of_them=not only)
    failed = any(law["verdict"] == "failed" for law in told)
    return component | {"failed": failed, "tried": tried, "warnings": dict(warned)}


def _tried(cls: type[Component], law: Any, drawn: Any, profile: Any, replay: str, warned: Counter[str]) -> Any:
    """Return what came of a law, and count what was warned of meanwhile."""
    from vedette.testing import examine

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        outcome = examine(cls, law, drawn, profile, replay)
    warned.update(f"{warning.message} ({Path(warning.filename).name}:{warning.lineno})" for warning in caught)
    return outcome


def _tell_counts(told: Sequence[Mapping[str, Any]], what: str, own: frozenset[str], *, all_of_them: bool) -> bool:
    """Print how many laws held, and so on; return whether one was tried that is the component's `own`, if it has such."""
    counts = Counter(law["verdict"] for law in told)
    said = ", ".join(
        f"{counts[verdict]} {verdict}" for verdict in ("held", "failed", "broken", "skipped") if counts[verdict]
    )
    skipped = [law["text"] for law in told if law["verdict"] == "skipped" and (law["law"] in own or not own)]
    tried = len(skipped) < (len(own) if own and all_of_them else len(told))
    print(f"  {said}{'' if tried else f': no law{what} applied, since {Counter(skipped).most_common(1)[0][0]}'}")
    return tried


def _those(laws: Sequence[Any], only: Iterable[str], role: str) -> Sequence[Any]:
    """Return the laws of the names `only`, all if there are none; ConfigError for a name that no law has."""
    names = [law.name for law in laws]
    for name in only:
        if name not in names:
            raise ConfigError.at("--law", f"a {role} has no law {name!r};{did_you_mean(name, names)}")
    return [law for law in laws if law.name in only] if only else laws


def _tell_beside(wanted: Iterable[str], warned: Counter[str]) -> None:
    """Print which parameters would be held to their names, and what was warned of."""
    if wanted:
        print(f"  a parameter called {', '.join(wanted)} would be held to its name, by laws that were skipped")
    for text, count in warned.most_common(MOST_WARNINGS):
        print(f"  warned {count} times: {text}")
    if len(warned) > MOST_WARNINGS:
        print(f"  and {len(warned) - MOST_WARNINGS} other warnings")


def _expected(verdict: str, text: str, known: str | None) -> tuple[str, str]:
    """Return the verdict on a law that a class may say it breaks on purpose: it must then fail."""
    if known is None or verdict == "skipped":
        return verdict, text
    if verdict == "failed":
        return "broken", f"on purpose: {known}"
    return "failed", f"it holds, and is declared to be broken on purpose: {known}"
