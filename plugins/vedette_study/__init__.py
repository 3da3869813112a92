"""Studies of many runs: a grid of trackers, run in lock-step or run by run, in threads, processes or on a cluster.

Names are imported when first used: a source or a reproduction needs little of what a study needs.
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Iterable
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vedette import Component, plugin
from vedette_study.commands import Reproduce, Study

if TYPE_CHECKING:
    from vedette_study.grid import short_names as short_names
    from vedette_study.lockstep import Runs as Runs
    from vedette_study.lockstep import run_together as run_together
    from vedette_study.plan import whole as whole
    from vedette_study.scenes import DrawsTogether as DrawsTogether
    from vedette_study.scenes import Scenes as Scenes
    from vedette_study.store import made_by as made_by
    from vedette_study.study import monte_carlo as monte_carlo

VEDETTE_CONTRACT = 2

_HOMES = {
    "Runs": "lockstep",
    "run_together": "lockstep",
    "DrawsTogether": "scenes",
    "Scenes": "scenes",
    "made_by": "store",
    "monte_carlo": "study",
    "short_names": "grid",
    "whole": "plan",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'vedette_study' has no attribute {name!r}")
    return getattr(import_module(f"vedette_study.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_HOMES]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Reproduce, Study]


@plugin
def vedette_page(folder: Path, arguments: Namespace) -> Path | None:
    """Write the page of a study's folder."""
    from vedette_study.commands.page import page_asked_for

    return page_asked_for(folder, arguments)
