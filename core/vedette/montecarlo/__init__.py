"""Studies of many runs: a grid of trackers, run in lock-step or run by run, in threads, processes or on a cluster.

Names are imported when first used: a source or a reproduction needs little of what a study needs.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from vedette.montecarlo.lockstep import Runs as Runs
    from vedette.montecarlo.lockstep import run_together as run_together
    from vedette.montecarlo.scenes import DrawsTogether as DrawsTogether
    from vedette.montecarlo.scenes import Scenes as Scenes
    from vedette.montecarlo.study import monte_carlo as monte_carlo

_HOMES = {
    "Runs": "lockstep",
    "run_together": "lockstep",
    "DrawsTogether": "scenes",
    "Scenes": "scenes",
    "monte_carlo": "study",
}


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'vedette.montecarlo' has no attribute {name!r}")
    return getattr(import_module(f"vedette.montecarlo.{_HOMES[name]}"), name)


def __dir__() -> list[str]:
    return list(_HOMES)
