"""Tools for a config: drafted for a table of detections, explained in words, tuned on a recording."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from vedette import Component, plugin
from vedette_tools.commands import Explain, New, Tune

if TYPE_CHECKING:
    from vedette_tools.drafting import track as track
    from vedette_tools.tuning import tune as tune

VEDETTE_CONTRACT = 2

_HOMES = {"track": "drafting", "tune": "tuning"}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'vedette_tools' has no attribute {name!r}")
    return getattr(import_module(f"vedette_tools.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_HOMES]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Explain, New, Tune]
