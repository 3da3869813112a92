"""Each component of the infrared study, broken: the verdicts that it must move move, and no other."""

import numpy as np
import pytest
from attrs import evolve

from support.breaks import Break, made_of, moved, named, sure, verdicts
from vedette_flir.camera import Camera
from vedette_flir.elements import ELEMENTS
from vedette_flir.estimators.monitored import ResidualMonitored
from vedette_flir.estimators.whitened import WhitenedFilter
from vedette_flir.matched_truth import record
from vedette_flir.motion.atmospheric_wander import AtmosphericWander
from vedette_flir.motion.constant_axes import Carrying
from vedette_flir.motion.jittered_acceleration import JitteredAcceleration
from vedette_flir.motion.jittered_wander import JitteredWander
from vedette_flir.robustness import variations
from vedette_flir.sensors.gaussian_spot import GaussianSpot
from vedette_flir.sensors.hot_spots import HotSpots
from vedette_flir.sensors.image_model import FittedImage
from vedette_flir.verdicts import claims, figures
from vedette_standard.estimators.iterated import IteratedExtendedKalman

RUNS = 4
CASES = ((0.2, 2.0, 10.0), (0.5, 2.0, 20.0))
UNJUDGED = ("noise correlated over space, SNR 3", "noise correlated over time, SNR 10", "white noise, SNR 3")
TRACKS, ONCE, LEARNS, SPOTS = "An extended Kalman", "The single-pass", "On-line adaptation", "Targets with several"
SPACE, TIME, ADAPTS = "A proper correlation", "The correlation of the noise over time", "Adapting the state noise"


def study():
    found = {
        case: {"three passes": record(3, case[1], case[2], case[0], RUNS, np.random.default_rng((7, i)))}
        for i, case in enumerate(CASES)
    }
    rows = [(i, each) for i, each in enumerate(variations()) if each.label not in UNJUDGED]
    varied = {each.label: {name: each.record(name, RUNS, (7, 1000 + i)) for name in each.filters} for i, each in rows}
    return verdicts(claims(sure(figures(found, varied)), RUNS))


@pytest.fixture(scope="module")
def right():
    return study()


def half_slopes(right):
    def picture(self, looks, x, y):
        made = right(self, looks, x, y)
        return evolve(made, slopes=0.5 * made.slopes)

    return picture


def first_spot_alone(right):
    return lambda self, x, frame, at: right(evolve(self, spots=self.spots[:1]), x, frame, at)


def restless(right):
    return lambda self, x, dt: 9.0 * right(self, x, dt)


def hardly_accelerates(right):
    jerk = np.array([[1e-6] * 3 + [1.0]] * 3 + [[1.0] * 4])
    return lambda self, dt: (right(self, dt)[0], right(self, dt)[1] * jerk)


def hardly_wanders(right):
    return lambda self, dt: (right(self, dt)[0], 0.01 * right(self, dt)[1])


def hardly_moves(right):
    return lambda self, x, dt: 0.01 * right(self, x, dt)


def once(right):
    return lambda self, *given: right(evolve(self, passes=1) if self.passes > 1 else self, *given)


def never_learns(right):
    return lambda self, x, frame: x


def takes_all_for_white(right):
    return lambda self, images, seen: images * (seen / self.sigma**2)[..., None, :]


def forgets(right):
    return lambda self, belief, window: np.full(window.values.shape, np.nan)


def stays(right):
    return lambda self, belief, innovation, weights: evolve(right(self, belief, innovation, weights), scale=belief.scale)


BREAKS = {
    "sensor gaussian_spot": Break(GaussianSpot, "picture", half_slopes, (TRACKS, ONCE, LEARNS, TIME, ADAPTS)),
    "sensor hot_spots": Break(HotSpots, "information", first_spot_alone, (SPOTS,)),
    "motion atmospheric_wander": Break(
        AtmosphericWander, "noise", restless, (TRACKS, ONCE, LEARNS, SPOTS, SPACE, TIME, ADAPTS)
    ),
    "motion jittered_acceleration": Break(
        JitteredAcceleration, "one_axis", hardly_accelerates, (ONCE, LEARNS, SPACE, TIME, ADAPTS)
    ),
    "motion jittered_wander": Break(JitteredWander, "one_axis", hardly_wanders, (TRACKS,)),
    "motion carrying": Break(Carrying, "noise", hardly_moves, (TRACKS, ONCE, LEARNS, SPACE, ADAPTS)),
    "estimator iekf": Break(IteratedExtendedKalman, "evaluate", once, (TRACKS, LEARNS)),
    "what a camera learns": Break(FittedImage, "learn", never_learns, (LEARNS,)),
    "noise of a camera": Break(Camera, "weigh", takes_all_for_white, (SPACE,)),
    "estimator whitened_filter": Break(WhitenedFilter, "_earlier", forgets, (TIME,)),
    "estimator residual_monitored": Break(ResidualMonitored, "update", stays, (ADAPTS,)),
}
BESIDE = {"sensor elliptic_spot", "estimator ekf", "estimator template_filter"}
"""Not in the study: an ellipse is a spot with one more axis, `ekf` is `iekf` with one pass, clips are in docs/flir.md."""


def test_every_component_of_the_paper_is_broken():
    assert {
        name for name in BREAKS if " " in name and name.split()[0] in ("sensor", "motion", "estimator")
    } | BESIDE == made_of(ELEMENTS)


@pytest.mark.nightly("eleven studies of 4 runs: 150 s")
@pytest.mark.parametrize("component", BREAKS)
def test_a_break_moves_the_verdicts_that_it_names_and_no_other(component, right):
    assert moved(study, right, BREAKS[component]) == named(right, BREAKS[component].moves)
