"""The components in a value, with their places in its config."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

import attrs

from vedette.roles import Component

_SIMPLE = re.compile(r"[A-Za-z0-9_-]+")
"""A name that a path holds without quotes."""

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
                yield from parts(part, place if field.name == INLINE else below(place, field.name))
    elif isinstance(value, Mapping | list | tuple):
        for step, part in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from parts(part, below(place, step if isinstance(step, int) else str(step)))


def below(place: str, step: str | int) -> str:
    """Return the path of a name in the table at `place`, or of an entry in the list there."""
    if isinstance(step, int):
        return f"{place}[{step}]"
    written = step if _SIMPLE.fullmatch(step) else f'"{step}"'
    return f"{place}.{written}" if place else written
