"""Draw trajectories from motion models, and detections of them from sensors."""

from vedette.sampling.clutter import Bounds, ceiling, corners, densities, draw_clutter, thinned
from vedette.sampling.detections import draw_detections, returns, shuffled
from vedette.sampling.gaussians import draw_gaussian, psd_root
from vedette.sampling.jumps import Modes, common_state, draw_jump_markov, follow_modes, switch, union_state
from vedette.sampling.seeds import NO_DRAWS, NotInLockStep, Seeds
from vedette.sampling.trajectories import draw_states, follow
