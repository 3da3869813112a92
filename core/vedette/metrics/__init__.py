"""How good tracks are: errors, coverage, losses, identity switches, set distances. docs/metrics.md defines the figures."""

from vedette.metrics.bound import Bound, enumerated_bound, information, reduced_bound
from vedette.metrics.clear import Clear, clear_mot
from vedette.metrics.consistency import chi_square_band, nees
from vedette.metrics.coverage import covering, is_lost, switches
from vedette.metrics.errors import rmse, rmse_over_runs
from vedette.metrics.gospa import Gospa, distances, gospa, ospa
from vedette.metrics.hota import Hota, hota
from vedette.metrics.matching import Match, match
from vedette.metrics.ospa2 import ospa2
from vedette.metrics.running import Block, RunningJudge, judge
from vedette.metrics.score import FIGURES, Figure, Judge, Score, TruthScore
from vedette.metrics.siap import Siap, siap
from vedette.metrics.trajectory import TrajectoryGospa, trajectory_gospa

__all__ = [
    "FIGURES",
    "Block",
    "Bound",
    "Clear",
    "Figure",
    "Gospa",
    "Hota",
    "Judge",
    "Match",
    "RunningJudge",
    "Score",
    "Siap",
    "TrajectoryGospa",
    "TruthScore",
    "chi_square_band",
    "clear_mot",
    "covering",
    "distances",
    "enumerated_bound",
    "gospa",
    "hota",
    "information",
    "is_lost",
    "judge",
    "match",
    "nees",
    "ospa",
    "ospa2",
    "reduced_bound",
    "rmse",
    "rmse_over_runs",
    "siap",
    "switches",
    "trajectory_gospa",
]
