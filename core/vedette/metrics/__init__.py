"""How good tracks are: errors, coverage, losses, identity switches, set distances. docs/metrics.md defines the figures."""

from vedette.metrics.bound import Bound, bound_along, enumerated_bound, information, reduced_bound
from vedette.metrics.clear import Clear, clear_mot
from vedette.metrics.consistency import chi_square_band, gate_truncation, nees
from vedette.metrics.coverage import NONE, Indices, covering, is_lost, switches
from vedette.metrics.errors import rmse, rmse_over_runs
from vedette.metrics.gospa import Gospa, distances, gospa, ospa
from vedette.metrics.histories import Entries, positions, truth_at, velocities
from vedette.metrics.hota import Hota, hota
from vedette.metrics.matching import Match, Pairs, match
from vedette.metrics.noises import at_fault
from vedette.metrics.ospa2 import ospa2
from vedette.metrics.running import ENTRIES, SCANS, Block, RunningJudge, gate_of, judge, space_of
from vedette.metrics.score import FIGURES, OF_OBJECTS, Figure, Judge, Score, TruthScore
from vedette.metrics.siap import Siap, siap
from vedette.metrics.trajectory import TrajectoryGospa, trajectory_gospa

__all__ = [
    "ENTRIES",
    "FIGURES",
    "NONE",
    "OF_OBJECTS",
    "SCANS",
    "Block",
    "Bound",
    "Clear",
    "Entries",
    "Figure",
    "Gospa",
    "Hota",
    "Indices",
    "Judge",
    "Match",
    "Pairs",
    "RunningJudge",
    "Score",
    "Siap",
    "TrajectoryGospa",
    "TruthScore",
    "at_fault",
    "bound_along",
    "chi_square_band",
    "clear_mot",
    "covering",
    "distances",
    "enumerated_bound",
    "gate_of",
    "gate_truncation",
    "gospa",
    "hota",
    "information",
    "is_lost",
    "judge",
    "match",
    "nees",
    "ospa",
    "ospa2",
    "positions",
    "reduced_bound",
    "rmse",
    "rmse_over_runs",
    "siap",
    "space_of",
    "switches",
    "trajectory_gospa",
    "truth_at",
    "velocities",
]
