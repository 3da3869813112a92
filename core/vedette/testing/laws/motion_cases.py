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


def drawn(draw: st.DrawFn, model: MotionModel, profile: Profile) -> Moves:
    """What every law of a motion model is given."""
    x, step = frozen_copy(draw(points(model.state, 3))), frozen_copy(draw(points(model.state, 3)))
    return Moves(x, step, draw(STEPS), draw(STEPS), draw(SEEDS), profile.runs, profile.alpha)
