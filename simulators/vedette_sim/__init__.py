"""Simulated truth and what sensors see of it: trajectories, detections, clutter, scenes."""

from collections.abc import Iterable

import vedette
from vedette.sampling import (
    Bounds,
    common_state,
    draw_clutter,
    draw_detections,
    draw_gaussian,
    draw_jump_markov,
    draw_states,
    follow,
    follow_modes,
    psd_root,
    returns,
    switch,
    union_state,
)
from vedette_sim.ais import Transponder
from vedette_sim.convoy import Convoy
from vedette_sim.crossing import Crossing
from vedette_sim.infrared import HotSpot, HotTarget, InfraredScene
from vedette_sim.look import Look
from vedette_sim.marine_hull import Vessel
from vedette_sim.marine_points import PointRuns, RadarPointsScene
from vedette_sim.marine_scene import RadarPicturesScene
from vedette_sim.marine_surroundings import Buoy, Land, Racon, Rain
from vedette_sim.population import Population
from vedette_sim.ppi import PpiRadar
from vedette_sim.random_motion import Drawn
from vedette_sim.scenario import Simulation
from vedette_sim.sea import SeaClutter
from vedette_sim.ships import Leg, Ship

__all__ = [
    "Bounds",
    "Buoy",
    "Convoy",
    "Crossing",
    "Drawn",
    "HotSpot",
    "HotTarget",
    "InfraredScene",
    "Land",
    "Leg",
    "Look",
    "PointRuns",
    "Population",
    "PpiRadar",
    "Racon",
    "RadarPicturesScene",
    "RadarPointsScene",
    "Rain",
    "SeaClutter",
    "Ship",
    "Simulation",
    "Transponder",
    "Vessel",
    "common_state",
    "draw_clutter",
    "draw_detections",
    "draw_gaussian",
    "draw_jump_markov",
    "draw_states",
    "follow",
    "follow_modes",
    "psd_root",
    "returns",
    "switch",
    "union_state",
]

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return the simulated scenes."""
    return [Simulation, InfraredScene, RadarPicturesScene, RadarPointsScene]
