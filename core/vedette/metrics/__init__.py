"""How good tracks are: errors, coverage, losses, switches, set distances. docs/metrics.md defines the figures."""

from vedette.metrics.consistency import chi_square_band, nees
from vedette.metrics.coverage import covering, is_lost, switches
from vedette.metrics.errors import rmse, rmse_over_runs
from vedette.metrics.gospa import Gospa, distances, gospa, ospa
from vedette.metrics.judgement import judge
from vedette.metrics.matching import Match, match
from vedette.metrics.score import Judge, Score, TruthScore

__all__ = [
    "Gospa",
    "Judge",
    "Match",
    "Score",
    "TruthScore",
    "chi_square_band",
    "covering",
    "distances",
    "gospa",
    "is_lost",
    "judge",
    "match",
    "nees",
    "ospa",
    "rmse",
    "rmse_over_runs",
    "switches",
]
