"""Each component of the marine study, broken: the verdicts that it must move move, and no other."""

import numpy as np
import pytest

from support.breaks import Break, blind, made_of, moved, named, straight_for_ever, sure, verdicts
from vedette_marine import configs
from vedette_marine import reproduction as marine
from vedette_marine.elements import ELEMENTS
from vedette_marine.outcome import COAST, FILTERS
from vedette_marine.points import by_frame_number, draw, first_late
from vedette_marine.verdicts import claims, figures
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.imm import Imm
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_piecewise import CoordinatedTurnPiecewise
from vedette_standard.motion.random_walk_piecewise import RandomWalkPiecewise

RUNS = 8
TUNED = {"MANV-like": configs.TUNED_BOATS, "DARC-like": configs.TUNED_SHIP}
OVER_CV, OVER_CT, SHIP = (
    "IMM-PDAF is more accurate than CV-PDAF where",
    "IMM-PDAF is more accurate than CT-PDAF where",
    "IMM-PDAF is more accurate than CV-PDAF on the large",
)
ORDER, STABLE, SIZE, LATE = "The errors are in the order", "IMM-PDAF tracks", "Errors of 98", "A track that begins"


def study():
    """The first 400 frames of both scenes, judged as if their returns were those of pictures."""
    found, numbered, late = {}, {}, {}
    for i, (name, scene) in enumerate(marine.SCENES.items()):
        points = draw(scene() | {"frames": 400, "lost": 8}, RUNS, marine.CLUTTER, np.random.default_rng([5, i]))
        coasting, counted = first_late(points, COAST), by_frame_number(points)
        for target, own in enumerate(points.names):
            key, filters, sigma = f"{name} {own}", TUNED[name], marine.SIGMA[name]
            found[key, "tuned"] = {each: marine.record(name, points, target, filters[each], sigma) for each in FILTERS}
            by_number = marine.record(name, counted, target, filters[FILTERS[0]], sigma, lost=np.inf)
            numbered[key, "by number"] = {FILTERS[0]: by_number}
            late[key, "late"] = {
                each: marine.record(name, coasting, target, configs.TABLE_6[each], 10.0) for each in FILTERS
            }
    return verdicts(claims(sure(figures(found, numbered, late)), RUNS, pictures=True))


@pytest.fixture(scope="module")
def right():
    return study()


def to_the_other_side(right):
    mirror = np.array([1.0, 1, 1, 1, -1])
    return lambda self, x, dt: right(self, x * mirror, dt) * mirror


def backwards(right):
    return lambda self, x, dt: right(self, x * np.array([1.0, 1, -1, -1, 1]), dt)


def back_in_time(right):
    return lambda self, dt: right(self, -dt)


def loud(right):
    return lambda self, x, dt: 1e6 * right(self, x, dt)


BREAKS = {
    "associator pda": Break(Pda, "associate", blind, (OVER_CV, OVER_CT, SHIP, ORDER, STABLE, SIZE, LATE)),
    "estimator imm": Break(Imm, "update", straight_for_ever, (OVER_CV, OVER_CT, STABLE)),
    "motion coordinated_turn": Break(CoordinatedTurn, "move", to_the_other_side, (OVER_CV, OVER_CT, STABLE)),
    "motion coordinated_turn_piecewise": Break(CoordinatedTurnPiecewise, "move", backwards, (LATE,)),
    "motion constant_velocity_piecewise": Break(ConstantVelocityPiecewise, "transition", back_in_time, (LATE,)),
    "motion random_walk_piecewise": Break(RandomWalkPiecewise, "noise", loud, (LATE,)),
}
BESIDE = {
    *("birth announced", "lifecycle announced"),  # the study gives the same priors to all runs at once, as `Announced` makes
    *("preprocessor radar_picture", "sensor radar_screen"),  # of `marine-pictures`, a minute a run
}


def test_every_component_of_the_paper_is_broken():
    assert set(BREAKS) - {"motion coordinated_turn"} | BESIDE == made_of(ELEMENTS)


@pytest.mark.nightly("six studies of 8 runs: 15 s")
@pytest.mark.parametrize("component", BREAKS)
def test_a_break_moves_the_verdicts_that_it_names_and_no_other(component, right):
    assert moved(study, right, BREAKS[component]) == named(right, BREAKS[component].moves)
