"""Draw trajectories from motion models, and detections of them from sensors."""

from vedette.sampling.detections import (
    Bounds,
    ceiling,
    corners,
    densities,
    draw_clutter,
    draw_detections,
    returns,
    shuffled,
    thinned,
)
from vedette.sampling.generators import NO_DRAWS, NotInLockStep
from vedette.sampling.seeds import Seeds
from vedette.sampling.trajectories import (
    common_state,
    draw_gaussian,
    draw_jump_markov,
    draw_states,
    follow,
    follow_modes,
    psd_root,
    switch,
    union_state,
)
