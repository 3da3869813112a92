"""The components in a value, with their places in its config."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs

from vedette.roles import Component

INLINE = "tracker"
"""The part of an experiment whose parameters are at the config's top level, beside the experiment's own."""


def parts(value: Any, place: str = "") -> Iterator[tuple[str, Component]]:
    """Yield each component in `value`, outer ones first, with its place in the config."""
    if isinstance(value, Component):
        yield place, value
    if attrs.has(type(value)):
        for field in attrs.fields(type(value)):
            if field.init:
                part = getattr(value, field.name)
                yield from parts(part, place if field.name == INLINE else _below(place, field.name))
    elif isinstance(value, Mapping):
        for name, part in value.items():
            yield from parts(part, _below(place, str(name)))
    elif isinstance(value, list | tuple):
        for i, part in enumerate(value):
            yield from parts(part, f"{place}[{i}]")


def _below(place: str, name: str) -> str:
    return f"{place}.{name}" if place else name
