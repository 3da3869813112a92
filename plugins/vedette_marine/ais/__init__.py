"""Reports of AIS: read, and followed ship by ship."""

from vedette_marine.ais.reports import KNOT as KNOT
from vedette_marine.ais.reports import Reports as Reports
from vedette_marine.ais.reports import rate_of_turn as rate_of_turn
from vedette_marine.ais.reports import turn_rate as turn_rate
from vedette_marine.ais.tracks import trajectories as trajectories
