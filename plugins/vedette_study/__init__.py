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
    from vedette_study.panels import comparison as comparison
    from vedette_study.panels import mean_over_runs as mean_over_runs
    from vedette_study.panels import mode_panel as mode_panel
    from vedette_study.panels import over_runs as over_runs
    from vedette_study.plan import whole as whole
    from vedette_study.scenes import DrawsTogether as DrawsTogether
    from vedette_study.scenes import Scenes as Scenes
    from vedette_study.starts import over_axes as over_axes
    from vedette_study.starts import two_point as two_point
    from vedette_study.store import made_by as made_by
    from vedette_study.study import monte_carlo as monte_carlo

VEDETTE_CONTRACT = 2

_HOMES = {
    "grid": ("short_names",),
    "lockstep": ("Runs", "run_together"),
    "panels": ("comparison", "mean_over_runs", "mode_panel", "over_runs"),
    "plan": ("whole",),
    "scenes": ("DrawsTogether", "Scenes"),
    "starts": ("over_axes", "two_point"),
    "store": ("made_by",),
    "study": ("monte_carlo",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'vedette_study' has no attribute {name!r}")
    return getattr(import_module(f"vedette_study.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return [*globals(), *_HOME_OF]


@plugin
def vedette_components() -> Iterable[type[Component]]:
    """Return the commands."""
    return [Reproduce, Study]


@plugin
def vedette_page(folder: Path, arguments: Namespace) -> Path | None:
    """Write the page of a study's folder."""
    from vedette_study.commands.page import page_asked_for

    return page_asked_for(folder, arguments)
