"""No verdict on the NEES where the pairing radius cuts the errors: only the small ones of a right filter are then judged."""

import numpy as np
import pytest
from attrs import evolve

from support.results import result, still, track
from vedette import metrics
from vedette_report.summary.words import summary

SCANS = 400


def told(experiment, deviation, radius, scale=1.0):
    """Return the summary of a run whose errors have this deviation along each axis, the covariance being `scale` of it."""
    errors = np.zeros((SCANS, 4))
    errors[:, :2] = np.random.default_rng(3).normal(0.0, deviation, (SCANS, 2))
    cov = scale * np.diag([deviation**2, deviation**2, 1.0, 1.0])
    done = result([track(range(SCANS), errors, cov)], [still("buoy", [0, SCANS], (0.0, 0.0))], range(SCANS))
    experiment = evolve(experiment, judge=metrics.Judge(cover_radius=radius))
    score = metrics.judge(done.tracks, done.recording.truth, done.scans, experiment.judge)
    return " ".join(summary(experiment, done, score).split()), score


def test_a_right_filter_of_a_far_target_is_not_called_underconfident(scene):
    text, score = told(scene[0], deviation=80.0 / np.sqrt(2), radius=50.0)
    assert score.nees_position < 1 / 2, "within the radius the errors are less than half of what the covariances say"
    assert "underconfident" not in text
    said = "not judged: the pairing radius of 50 m cuts the errors, which the filter expects to be 80 m"
    assert f"{said}; set judge.cover_radius to 240 or more" in text


@pytest.mark.parametrize(("deviation", "odd"), [(0.5, True), (10.0, False), (100.0, True)])
def test_a_cut_off_of_50_m_is_said_to_be_out_of_proportion_to_the_errors(scene, deviation, odd):
    text, score = told(scene[0], deviation=deviation, radius=1000.0)
    assert score.position_rmse_m == pytest.approx(deviation * np.sqrt(2), rel=0.1)
    assert (text.count("judge.gospa_cutoff") == 1) == odd


@pytest.mark.costly
def test_with_the_radius_that_is_asked_for_it_is_judged(scene):
    text, score = told(scene[0], deviation=80.0 / np.sqrt(2), radius=240.0)
    assert score.nees_position == pytest.approx(1.0, rel=0.15)
    assert "the covariance fits the errors to within a factor of 2" in text


@pytest.mark.costly
def test_what_the_radius_cannot_hide_is_still_told(scene):
    """Too small by 30 even among the small errors: those left out are larger still."""
    text, _ = told(scene[0], deviation=200.0, radius=250.0, scale=0.03)
    assert "overconfident" in text
    text, _ = told(scene[0], deviation=2.0, radius=50.0, scale=20.0)
    assert "underconfident" in text


@pytest.mark.costly
def test_errors_far_within_the_radius_are_judged_whatever_the_filter_expects(scene):
    text, score = told(scene[0], deviation=0.15 * 50.0, radius=50.0, scale=20.0)
    assert score.position_deviation_m > 25.0
    assert "underconfident" in text


def test_the_limit_leaves_a_right_filter_its_nees():
    """At the limit, deviations of half the radius, the NEES of a right filter in the plane falls short by 7 to 8 %."""
    square = np.linspace(0.0, 8.0, 200_001)  # of the error over its variance, up to that at the radius
    density = np.exp(-square / 2)
    assert 0.5 * np.average(square, weights=density) == pytest.approx(0.925, abs=0.002)
