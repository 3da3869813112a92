"""Figures that compare whole tracks with whole true trajectories: trajectory GOSPA, OSPA(2), HOTA, MOTA, IDF1, SIAP."""

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
