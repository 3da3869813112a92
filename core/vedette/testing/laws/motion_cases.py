"""What the laws of motion models are tried on."""

from __future__ import annotations

from attrs import frozen
from hypothesis import strategies as st

from vedette.roles import MotionModel
from vedette.space import Array
from vedette.testing.comparisons import frozen_copy
from vedette.testing.law import Profile
from vedette.testing.states import SEEDS, STEPS, points


@frozen(eq=False)
class Moves:
    """States x (3, n), steps over their axes (3, n), two time steps in s, and what statistical laws need."""

    x: Array
    step: Array
    dt: float
    later: float
    seed: int
    runs: int
    alpha: float


def drawn(model: MotionModel, profile: Profile) -> st.SearchStrategy[Moves]:
    """What every law of a motion model is given."""
    x, step = points(model.state, 3).map(frozen_copy), points(model.state, 3).map(frozen_copy)
    return st.builds(Moves, x, step, STEPS, STEPS, SEEDS, st.just(profile.runs), st.just(profile.alpha))
