"""The birth of a config that names none: the usual one of its lifecycle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from vedette.config.registry import Registry
from vedette.supporting import Lifecycle


def with_birth(given: Mapping[str, Any], before: Mapping[str, Any], registry: Registry) -> dict[str, Any]:
    """Return a config whose birth has a kind: where it names none, that of its lifecycle.

    `before` is the config without its overrides: if they changed the lifecycle, what the birth took then and does not take
    now is left out.
    """
    usual, birth = _usual_birth(given, registry), given.get("birth", {})
    if not isinstance(birth, Mapping) or "kind" in birth:
        return dict(given)
    if usual is None:  # the lifecycle is at fault, and is told: nothing can be said of a birth that goes with it
        return {name: value for name, value in given.items() if name != "birth"}
    gone = _names(_usual_birth(before, registry), registry) - _names(usual, registry)
    return {**given, "birth": {**usual, **{name: value for name, value in birth.items() if name not in gone}}}


def _usual_birth(config: Mapping[str, Any], registry: Registry) -> Mapping[str, Any] | None:
    lifecycle = config.get("lifecycle")
    kind = lifecycle.get("kind") if isinstance(lifecycle, Mapping) else None
    entry = registry.find("lifecycle", kind) if isinstance(kind, str) else None
    cls = lifecycle if isinstance(lifecycle, Lifecycle) else None if entry is None else entry.cls
    return getattr(cls, "usual_birth", None)


def _names(birth: Mapping[str, Any] | None, registry: Registry) -> set[str]:
    """Return what a birth of this kind takes."""
    entry = None if birth is None else registry.find("birth", str(birth["kind"]))
    return set() if entry is None else {parameter.name for parameter in entry.parameters}
