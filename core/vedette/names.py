"""Names of `vedette` that plugins bring, such as `vedette.track`: the entry points of the group `vedette.names`.

Those of the group `vedette.testing.names` are names of `vedette.testing`.
"""

from __future__ import annotations

from importlib.metadata import EntryPoint, entry_points
from typing import Any

from vedette.errors import PluginError


def brought(module: str = "vedette") -> tuple[str, ...]:
    """Return the names of a module that plugins bring."""
    return tuple(sorted({point.name for point in entry_points(group=f"{module}.names")}))


def look_up(name: str, module: str = "vedette") -> Any:
    """Return what a plugin brings under this name; AttributeError if none does, PluginError if it cannot be had."""
    points = {(point.value, _distribution(point)): point for point in entry_points(group=f"{module}.names", name=name)}
    if not points:
        raise AttributeError(f"module {module!r} has no attribute {name!r}")
    if len(points) > 1:
        bringers = " and by ".join(f"{value} of {distribution}" for value, distribution in points)
        raise PluginError(f"{module}.{name} is brought by {bringers}: uninstall one of them")
    ((value, distribution), point), *_ = points.items()
    try:
        return point.load()
    except (Exception, SystemExit) as error:
        reason = f"{type(error).__name__}: {error}"
        raise PluginError(f"{module}.{name} is brought by {value} of {distribution}, which failed: {reason}") from error


def _distribution(point: EntryPoint) -> str:
    return "an unnamed distribution" if point.dist is None else point.dist.name
