"""The door that every component comes through, Vedette's own included.

A plugin is a module, named by an entry point in the group `vedette`, that implements one hook and may state the version of
the contract it was written for::

    import vedette

    VEDETTE_CONTRACT = 1

    @vedette.plugin
    def vedette_components():
        return [MyMotionModel]
"""

from __future__ import annotations

from collections.abc import Iterable

import pluggy

from vedette.roles import Component

plugin = pluggy.HookimplMarker("vedette")
specification = pluggy.HookspecMarker("vedette")


@specification
def vedette_components() -> Iterable[type[Component]]:  # type: ignore[empty-body]  # pluggy reads the signature only
    """The component classes that this plugin brings."""
