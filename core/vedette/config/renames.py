"""Names of the first contract, read as those of the second: configs that were valid stay valid."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vedette.config.registry import Registry
from vedette.errors import ConfigError, Problem
from vedette.supporting import Lifecycle

RENAMED = {"detectors": "preprocessors"}
"""Keys of a config."""

MOVED = ("spread", "sensors", "claimed", "initial", "start", "offset")
"""Keys that lifecycles had, and births have now."""


def renamed(given: Mapping[str, Any], registry: Registry) -> dict[str, Any]:
    """Return a config with the keys of the second contract; ConfigError if an old and a new name are both given."""
    config, problems = dict(given), []
    for old, new in RENAMED.items():
        if old in config and new in config:
            problems.append(Problem(old, f"is the old name of `{new}`; give only `{new}`"))
        elif old in config:
            config[new] = config.pop(old)
    lifecycle, birth = config.get("lifecycle"), config.get("birth", {})
    if isinstance(lifecycle, Mapping) and isinstance(birth, Mapping):
        own = _own_names(lifecycle, registry)
        moved = {name: lifecycle[name] for name in MOVED if name in lifecycle and name not in own}
        problems += [
            Problem(f"lifecycle.{n}", f"is the old name of `birth.{n}`; give only `birth.{n}`") for n in moved if n in birth
        ]
        if moved:
            config["lifecycle"] = {name: value for name, value in lifecycle.items() if name not in moved}
            config["birth"] = {**birth, **moved}
    if problems:
        raise ConfigError(problems)
    return config


def renamed_path(path: tuple[str | int, ...]) -> tuple[str | int, ...]:
    """Return the path of an override with the keys of the second contract."""
    if path[:1] == ("lifecycle",) and len(path) > 1 and path[1] in MOVED:
        return ("birth", *path[1:])
    return (RENAMED.get(str(path[0]), path[0]), *path[1:])


def with_birth(given: Mapping[str, Any], before: Mapping[str, Any], registry: Registry) -> dict[str, Any]:
    """Return a config with the birth's kind; if it names none, the usual one of its lifecycle.

    `before` is the config without its overrides: if they changed the lifecycle, what its old birth took and the new one
    does not is left out.
    """
    lifecycle, birth = given.get("lifecycle"), given.get("birth", {})
    usual = _usual_birth(lifecycle, registry)
    if not isinstance(birth, Mapping) or "kind" in birth:
        return dict(given)
    if usual is None:  # the lifecycle is at fault, and is told: nothing can be said of a birth that goes with it
        return {name: value for name, value in given.items() if name != "birth"}
    filled = {**usual, **birth}
    if (was := _usual_birth(before.get("lifecycle"), registry)) is not None and was["kind"] != usual["kind"]:
        entry = registry.find("birth", str(usual["kind"]))
        known = {parameter.name for parameter in entry.parameters} if entry is not None else set(filled)
        filled = {name: value for name, value in filled.items() if name == "kind" or name in known or name not in MOVED}
    return {**given, "birth": filled}


def _usual_birth(lifecycle: Any, registry: Registry) -> Mapping[str, Any] | None:
    if isinstance(lifecycle, Lifecycle):
        return lifecycle.usual_birth
    kind = lifecycle.get("kind") if isinstance(lifecycle, Mapping) else None
    entry = registry.find("lifecycle", kind) if isinstance(kind, str) else None
    usual: Mapping[str, Any] | None = None if entry is None else entry.cls.usual_birth  # type: ignore[attr-defined]
    return usual


def _own_names(lifecycle: Mapping[str, Any], registry: Registry) -> set[str]:
    """Return the parameters of the kind itself, which are not moved."""
    kind = lifecycle.get("kind")
    entry = registry.find("lifecycle", kind) if isinstance(kind, str) else None
    return set() if entry is None else {parameter.name for parameter in entry.parameters}
