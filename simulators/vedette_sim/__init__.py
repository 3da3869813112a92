"""Simulated truth and what sensors see of it: trajectories, detections, clutter, scenes."""

from collections.abc import Iterable

import vedette
from vedette.draws import (
    common_state,
    draw_gaussian,
    draw_jump_markov,
    draw_states,
    factor,
    follow,
    follow_modes,
    switch,
    union_state,
)
from vedette.returns import Bounds, draw_clutter, draw_detections, returns
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene
from vedette_sim.scenario import Drawn, Look, Simulation
from vedette_sim.ships import Leg, Ship

__all__ = [
    "Bounds",
    "Drawn",
    "HotSpot",
    "HotTarget",
    "InfraredScene",
    "Leg",
    "Look",
    "Ship",
    "Simulation",
    "common_state",
    "draw_clutter",
    "draw_detections",
    "draw_gaussian",
    "draw_jump_markov",
    "draw_states",
    "factor",
    "follow",
    "follow_modes",
    "returns",
    "switch",
    "union_state",
]

VEDETTE_CONTRACT = 1


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """The simulated scenes."""
    return [Simulation, InfraredScene]
