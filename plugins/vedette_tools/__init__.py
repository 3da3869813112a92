"""Tools: what is installed, listed and tested; a config drafted, explained, tuned on a recording; positions smoothed."""

from collections.abc import Iterable

from vedette import Component, plugin
from vedette_tools.commands import Check, Completions, Components, Explain, New, Schema, Smooth, Tune

VEDETTE_CONTRACT = 2


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Check, Completions, Components, Explain, New, Schema, Smooth, Tune]
