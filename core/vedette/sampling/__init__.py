"""Draw trajectories from motion models, and detections of them from sensors."""

from vedette.sampling.detections import Bounds as Bounds
from vedette.sampling.detections import ceiling as ceiling
from vedette.sampling.detections import corners as corners
from vedette.sampling.detections import densities as densities
from vedette.sampling.detections import draw_clutter as draw_clutter
from vedette.sampling.detections import draw_detections as draw_detections
from vedette.sampling.detections import returns as returns
from vedette.sampling.detections import shuffled as shuffled
from vedette.sampling.detections import thinned as thinned
from vedette.sampling.generators import NO_DRAWS as NO_DRAWS
from vedette.sampling.generators import NotInLockStep as NotInLockStep
from vedette.sampling.seeds import Seeds as Seeds
from vedette.sampling.trajectories import common_state as common_state
from vedette.sampling.trajectories import draw_gaussian as draw_gaussian
from vedette.sampling.trajectories import draw_jump_markov as draw_jump_markov
from vedette.sampling.trajectories import draw_states as draw_states
from vedette.sampling.trajectories import follow as follow
from vedette.sampling.trajectories import follow_modes as follow_modes
from vedette.sampling.trajectories import psd_root as psd_root
from vedette.sampling.trajectories import switch as switch
from vedette.sampling.trajectories import union_state as union_state
