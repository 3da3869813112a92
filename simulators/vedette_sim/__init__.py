"""Simulated truth and what sensors see of it: trajectories, detections, clutter, scenes."""

from collections.abc import Iterable

import vedette
from vedette.sampling import Bounds as Bounds
from vedette_sim.ais import Transponder as Transponder
from vedette_sim.convoy import Convoy as Convoy
from vedette_sim.crossing import Crossing as Crossing
from vedette_sim.infrared import HotSpot as HotSpot
from vedette_sim.infrared import HotTarget as HotTarget
from vedette_sim.infrared import InfraredScene as InfraredScene
from vedette_sim.look import Look as Look
from vedette_sim.marine_hull import Vessel as Vessel
from vedette_sim.marine_points import PointRuns as PointRuns
from vedette_sim.marine_points import RadarPointsScene as RadarPointsScene
from vedette_sim.marine_scene import RadarPicturesScene as RadarPicturesScene
from vedette_sim.marine_surroundings import Buoy as Buoy
from vedette_sim.marine_surroundings import Land as Land
from vedette_sim.marine_surroundings import Racon as Racon
from vedette_sim.marine_surroundings import Rain as Rain
from vedette_sim.population import Population as Population
from vedette_sim.ppi import PpiRadar as PpiRadar
from vedette_sim.random_motion import Drawn as Drawn
from vedette_sim.scenario import Simulation as Simulation
from vedette_sim.sea import SeaClutter as SeaClutter
from vedette_sim.ships import Leg as Leg
from vedette_sim.ships import Ship as Ship

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return the simulated scenes."""
    return [Simulation, InfraredScene, RadarPicturesScene, RadarPointsScene]
