"""Each component of the study of the vessel traffic radar, broken: the verdicts that it must move move, and no other."""

import numpy as np
import pytest

from support.breaks import Break, made_of, moved, named, straight_for_ever, sure, too_sure, verdicts
from vedette import load
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.motion.constant_velocity_piecewise import ConstantVelocityPiecewise
from vedette_standard.motion.wiener_acceleration_piecewise import WienerAccelerationPiecewise
from vedette_standard.preprocessors.naive_conversion import NaiveConversion
from vedette_standard.sensors.polar_position import PolarPosition
from vedette_vts.configs import FILTERS
from vedette_vts.elements import ELEMENTS
from vedette_vts.reproduction import draw, record
from vedette_vts.verdicts import claims, figures

RUNS = 40
LOSES, CAKF = "The CVKF errs much", "The returns stay in the gate of the CAKF"
CV2, CVCA = "The returns stay in the gate of the IMMCV2", "The returns stay in the gate of the IMMCVCA"
ALWAYS, BETTER = "The returns are always", "The IMM keeps the track"


def study():
    experiments = {name: load(config) for name, config in FILTERS.items()}
    scene = draw(experiments["CVKF"], RUNS, np.random.default_rng(3))
    records = {name: record(each, scene) for name, each in experiments.items()}
    return verdicts(claims(sure(figures(records)), RUNS))


@pytest.fixture(scope="module")
def right():
    return study()


def quiet(right):
    return lambda self, dt: 1e-4 * right(self, dt)


def shifted_and_far_too_sure(right):
    def moments(self, r, along, across):
        factor, *variances = right(self, r, along, across)
        return 1.01 * factor, *(0.05 * each for each in variances)

    return moments


def turned(right):
    return lambda self, x: right(self, x) * np.array([1.0, 1.02])


BREAKS = {
    "motion constant_velocity_piecewise": Break(ConstantVelocityPiecewise, "covariance", quiet, (CV2, ALWAYS, BETTER)),
    "motion wiener_acceleration_piecewise": Break(
        WienerAccelerationPiecewise, "covariance", quiet, (CAKF, CVCA, ALWAYS, BETTER)
    ),
    "preprocessor naive_conversion": Break(
        NaiveConversion, "moments", shifted_and_far_too_sure, (LOSES, CAKF, CV2, CVCA, ALWAYS, BETTER)
    ),
    "sensor polar_position": Break(PolarPosition, "measure", turned, (LOSES, ALWAYS, BETTER)),
    "estimator imm": Break(Imm, "update", straight_for_ever, (CV2, CVCA, ALWAYS, BETTER)),
    "estimator kalman": Break(Kalman, "predict", too_sure, (CAKF, CV2, CVCA, ALWAYS, BETTER)),
}
BESIDE = {"preprocessor decorrelated_conversion", "sensor decorrelated_position"}
"""Components that the paper does not have: no verdict rests on them."""


def test_every_component_of_the_paper_is_broken():
    assert set(BREAKS) | BESIDE == made_of(ELEMENTS)


@pytest.mark.parametrize("component", BREAKS)
@pytest.mark.costly
def test_a_break_moves_the_verdicts_that_it_names_and_no_other(component, right):
    assert moved(study, right, BREAKS[component]) == named(right, BREAKS[component].moves)
