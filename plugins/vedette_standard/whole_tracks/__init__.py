"""Figures that compare whole tracks with whole true trajectories, and the least error that a filter can have along them."""

from vedette_standard.whole_tracks.bound import bound_along as bound_along
from vedette_standard.whole_tracks.bound import enumerated_bound as enumerated_bound
from vedette_standard.whole_tracks.bound import information as information
from vedette_standard.whole_tracks.bound import reduced_bound as reduced_bound
from vedette_standard.whole_tracks.clear import Clear as Clear
from vedette_standard.whole_tracks.clear import clear_mot as clear_mot
from vedette_standard.whole_tracks.collector import WholeTracks as WholeTracks
from vedette_standard.whole_tracks.hota import Hota as Hota
from vedette_standard.whole_tracks.hota import hota as hota
from vedette_standard.whole_tracks.idf1 import idf1 as idf1
from vedette_standard.whole_tracks.ospa2 import ospa2 as ospa2
from vedette_standard.whole_tracks.siap import Siap as Siap
from vedette_standard.whole_tracks.siap import siap as siap
from vedette_standard.whole_tracks.trajectory import TrajectoryGospa as TrajectoryGospa
from vedette_standard.whole_tracks.trajectory import trajectory_gospa as trajectory_gospa
