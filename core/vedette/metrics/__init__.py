"""How good tracks are: errors, coverage, losses, identity switches, set distances. docs/metrics.md defines the figures."""

from vedette.metrics.consistency import asymmetric, chi_square_band, free_axes, gate_truncation, nees, within_gate
from vedette.metrics.coverage import NONE, covering, switches
from vedette.metrics.gospa import Gospa, distances, gospa, ospa
from vedette.metrics.histories import Entries, positions, truth_at, velocities
from vedette.metrics.matching import Match, MatchedPairs
from vedette.metrics.near_pairs import Near, near, one_to_one
from vedette.metrics.running import ENTRIES, SCANS, Block, RunningJudge, gate_of, judge, space_of
from vedette.metrics.score import FIGURES, OF_OBJECTS, Bound, Figure, Judge, Score, TruthScore
