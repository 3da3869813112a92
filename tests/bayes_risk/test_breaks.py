"""Each component of the study of Bayes-risk detection, broken: the verdicts that it must move move, and no other."""

import numpy as np
import pytest

from support.breaks import Break, blind, made_of, moved, named, straight_for_ever, sure, too_sure, verdicts
from vedette import load
from vedette_bayes_risk.associator import BayesRisk
from vedette_bayes_risk.configs import CONTESTED, FILTERS
from vedette_bayes_risk.elements import ELEMENTS
from vedette_bayes_risk.parallel import ParallelKalmanPrinted
from vedette_bayes_risk.printed import BayesRiskPrinted
from vedette_bayes_risk.reproduction import DENSE_REACH, REACH, contest, draw, record
from vedette_bayes_risk.tail import BayesRiskDetection
from vedette_bayes_risk.verdicts import FORMS, claims, figures
from vedette_standard.associators.pda import Pda
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman

RUNS = 60
JUDGED = [f"{weights} weights, {form}" for weights in ("printed", "corrected") for form in FORMS]
SAME, GAIN = "The error in manoeuvres", "The proposed filter is"
SUMS, COVARIANCE = "P_D(k) and P_F(k)", "P(k | k) = sum"


def study():
    first, second = np.random.default_rng(3).spawn(2)
    experiments = {name: load(config) for name, config in (FILTERS | CONTESTED).items()}
    scene = draw(experiments["proposed"], RUNS, REACH, first)
    crowd = draw(experiments[JUDGED[0]], RUNS, DENSE_REACH, second)
    records = {name: record(experiments[name], *scene) for name in FILTERS}
    contests = {name: contest(experiments[name], *crowd) for name in JUDGED}
    return verdicts(claims(sure(figures(records, contests, experiments)), RUNS, RUNS))


@pytest.fixture(scope="module")
def right():
    return study()


def all_and_one_more(right):
    return lambda self: 8


def summed_from_above(right):
    return lambda self: BayesRiskDetection.log_weights(self)


def with_the_spread(right):
    return lambda self, belief, innovation, weights: Kalman.update(self, belief, innovation, weights)


BREAKS = {
    "preprocessor bayes_risk_detection": Break(BayesRiskDetection, "least", all_and_one_more, (SAME,)),
    "preprocessor bayes_risk_printed": Break(BayesRiskPrinted, "log_weights", summed_from_above, (SUMS,)),
    "associator bayes_risk": Break(BayesRisk, "associate", blind, (SAME, COVARIANCE)),
    "estimator parallel_kalman_printed": Break(ParallelKalmanPrinted, "update", with_the_spread, (COVARIANCE,)),
    "estimator kalman": Break(Kalman, "predict", too_sure, (SAME,)),
    "estimator imm": Break(Imm, "update", straight_for_ever, (GAIN,)),
    "associator pda": Break(Pda, "associate", blind, (GAIN,)),
}
BESIDE = {
    *("preprocessor bayes_risk_by_count", "preprocessor clustered_detection", "preprocessor count_likelihood_detection"),
    "preprocessor bayes_risk_decision",
}
"""Not in the paper, or of its section 2, which claims nothing: no verdict rests on them."""


def test_every_component_of_the_paper_is_broken():
    assert set(BREAKS) | BESIDE == made_of(ELEMENTS)


@pytest.mark.nightly("seven studies of 60 runs: 60 s")
@pytest.mark.parametrize("component", BREAKS)
def test_a_break_moves_the_verdicts_that_it_names_and_no_other(component, right):
    assert moved(study, right, BREAKS[component]) == named(right, BREAKS[component].moves)
