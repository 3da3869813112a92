"""Tools for a config: drafted for a table of detections, explained in words, tuned on a recording; positions smoothed."""

from collections.abc import Iterable

from vedette import Component, plugin
from vedette_tools.commands import Completions, Explain, New, Smooth, Tune

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Completions, Explain, New, Smooth, Tune]
