"""Consistency statistics against textbook formulas, and by their size on right filters.

Statistical tests are seeded; their false-alarm rate is what a new seed would risk. Z is the normal quantile for 1e-7.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import chdtr, stdtr

from support.gaussians import covariances, draw, seeds
from vedette.metrics import consistency as c
from vedette_report import consistency as verdicts
from vedette_report.recorded.credibility import noncredibility
from vedette_study.over_runs import calibration_verdicts, equivalence_verdict

ALPHA = 1e-7
Z = 5.33


# NEES
@given(seeds, st.integers(1, 5))
@settings(max_examples=50)
def test_nees_is_the_quadratic_form_and_a_batch_is_a_loop(rng, n):
    cov = covariances(rng, 3, 2, n)
    error = rng.normal(size=(3, 2, n)) * np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
    batch = c.nees(error, cov)
    for i in np.ndindex(3, 2):
        assert batch[i] == pytest.approx(error[i] @ np.linalg.solve(cov[i], error[i]), rel=1e-8)
        assert batch[i] == pytest.approx(c.nees(error[i], cov[i]), rel=1e-12)


@given(seeds)
@settings(max_examples=30)
def test_nees_does_not_depend_on_the_axes(rng):
    cov, turn = covariances(rng, 4, orders=0), rng.normal(size=(4, 4)) + 3 * np.eye(4)
    error = draw(rng, cov, 5)
    assert np.allclose(c.nees(error @ turn.T, turn @ cov @ turn.T), c.nees(error, cov), rtol=1e-6)


def test_axes_without_variance_are_skipped():
    rng = np.random.default_rng(1)
    small, error = covariances(rng, 2), np.array([1.0, 9.0, 2.0])
    cov = np.zeros((3, 3))
    cov[np.ix_([0, 2], [0, 2])] = small
    assert c.nees(error, cov) == pytest.approx(c.nees(error[[0, 2]], small), rel=1e-12)
    assert c.free_axes(cov) == 2
    assert verdicts.normalised_error(error, cov)[1] == 0
    assert c.nees(error, np.zeros((3, 3))) == 0


def test_arguments_are_left_as_they_were():
    error, cov = np.ones((3, 2)), np.broadcast_to(np.diag([1.0, 0.0]), (3, 2, 2))
    error.flags.writeable = False
    assert np.array_equal(c.nees(error, cov), np.ones(3))


NO_COVARIANCES = ([[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]], [[2.0, 1.5], [0.0, 2.0]])


@pytest.mark.parametrize("cov", NO_COVARIANCES)
def test_what_is_no_covariance_is_refused(cov):
    with pytest.raises(ValueError, match=r"^cov: "):
        c.nees(np.ones(2), np.array(cov))


# Bands
@pytest.mark.parametrize(("dof", "alpha"), [(1, 0.05), (40, 1e-3), (4000, 1e-7), (100_000, 1e-9)])
def test_chi_square_band_leaves_half_of_alpha_on_each_side(dof, alpha):
    low, high = c.chi_square_band(dof, alpha)
    assert chdtr(dof, low * dof) == pytest.approx(alpha / 2, rel=1e-6)
    assert chdtr(dof, high * dof) == pytest.approx(1 - alpha / 2, rel=1e-6)
    assert low < 1 < high or dof == 1


@pytest.mark.parametrize(("dof", "alpha"), [(0, 0.05), (5, 0.0), (5, 1.0), (np.nan, 0.05)])
def test_a_band_needs_degrees_of_freedom_and_a_probability(dof, alpha):
    with pytest.raises(ValueError, match=r"^dof: "):
        c.chi_square_band(dof, alpha)


def within_its_size(alarms, alpha):
    """Whether the number of false alarms is what `alpha` says, itself at a false-alarm rate of 1e-7."""
    count = len(alarms)
    return abs(np.sum(alarms) - alpha * count) <= Z * np.sqrt(count * alpha * (1 - alpha)) + 1


@pytest.mark.costly
def test_sizes_of_the_exact_verdicts():
    """False alarms on 2,000 right sets of 30 runs at 5 %: chi-square, bias and every axis' calibration."""
    rng = np.random.default_rng(2)
    cov = covariances(rng, 3)
    nees, bias, axis, mean = [], [], [], []
    for _ in range(2000):
        error = draw(rng, cov, 30)
        nees.append(not verdicts.chi_square_verdict("NEES", c.nees(error, cov), 3, 0.05).inside)
        bias.append(not verdicts.bias_verdict(error[:, :1], cov[:1, :1], ("x",), 0.05).inside)
        axis.append(not calibration_verdicts(error, cov, ("x", "y", "z"), 0.15)[1].inside)
        mean.append(
            not verdicts.run_mean_verdict("mean", 1 + error[:, 0] / np.sqrt(cov[0, 0]), 1.0, 1.0, 0.05, -np.inf).inside
        )
    assert within_its_size(nees, 0.05)
    assert within_its_size(bias, 0.05)
    assert within_its_size(axis, 0.05)
    assert within_its_size(mean, 0.05)


@pytest.mark.costly
def test_size_of_the_worst_of_several_axes_and_lags():
    """The family of axes or lags alarms with alpha at most, and not much less."""
    rng = np.random.default_rng(3)
    bias, white = [], []
    for _ in range(2000):
        bias.append(not verdicts.bias_verdict(rng.normal(size=(30, 3)), np.eye(3), ("x", "y", "z"), 0.05).inside)
        white.append(not verdicts.whiteness_verdict(rng.normal(size=(4, 50, 2)), np.eye(2), 5, 0.05).inside)
    assert 0.02 < np.mean(bias) < 0.05 + Z * np.sqrt(0.05 * 0.95 / 2000)
    assert 0.02 < np.mean(white) < 0.05 + Z * np.sqrt(0.05 * 0.95 / 2000)


def test_a_covariance_wrong_by_half_is_found_and_told():
    """500 runs of 2 axes: the half-width at 1e-7 is 5.33 sqrt(2 / 1000) = 24 %."""
    rng = np.random.default_rng(4)
    cov = covariances(rng, 2)
    error = draw(rng, cov, 500)
    assert verdicts.chi_square_verdict("NEES", c.nees(error, cov), 2, ALPHA).inside
    small = verdicts.chi_square_verdict("NEES", c.nees(error, cov / 1.5), 2, ALPHA)
    large = verdicts.chi_square_verdict("NEES", c.nees(error, cov * 1.5), 2, ALPHA)
    assert not small.inside
    assert "the covariance is 1.5 times too small" in small.text
    assert not large.inside
    assert "the covariance is 1.5 times too large" in large.text


def test_degrees_of_freedom_may_differ_from_value_to_value():
    values, dof = np.array([1.0, 4.0, 10.0]), np.array([1.0, 2.0, 2.0])
    verdict = verdicts.chi_square_verdict("NIS", values, dof, 0.05)
    assert verdict.figure == 3.0
    assert (verdict.low, verdict.high) == c.chi_square_band(5, 0.05)


# Means over runs
def test_run_mean_and_equivalence_by_hand():
    values = np.array([1.0, 1.2, 1.1, 1.3])
    error = np.sqrt(((values - 1.15) ** 2).sum() / 3 / 4)
    lenient = verdicts.run_mean_verdict("ANEES", values, 0.9, 1.1, 0.05, -np.inf)
    strict = equivalence_verdict("ANEES", values, 0.9, 1.1, 0.05)
    assert lenient.error == pytest.approx(error)
    assert lenient.figure == pytest.approx(1.15)
    assert stdtr(3, (0.9 - lenient.low) / error) == pytest.approx(1 - 0.05 / 2)
    assert lenient.high - 1.1 == pytest.approx(0.9 - lenient.low)
    assert f"0.9 to 1.1 and {lenient.high - 1.1:.2g} for chance" in lenient.text
    assert lenient.inside
    assert not strict.inside
    assert "too few runs" in strict.text
    assert strict.low == pytest.approx(0.9 + lenient.high - 1.1)


@pytest.mark.costly
def test_run_mean_lets_the_edge_of_its_band_pass_and_equivalence_does_not():
    """Runs whose true mean is the band's edge: each verdict errs in alpha / 2 of the sets."""
    rng = np.random.default_rng(5)
    values = 1.1 + 0.3 * rng.normal(size=(4000, 50))
    wrongly_out = [not verdicts.run_mean_verdict("m", row, 0.9, 1.1, 0.1, -np.inf).inside for row in values]
    wrongly_in = [equivalence_verdict("m", row, 0.7, 1.1, 0.1).inside for row in values]
    assert within_its_size(wrongly_out, 0.05)
    assert within_its_size(wrongly_in, 0.05)


def test_mean_over_runs():
    assert verdicts.mean_over_runs(np.array([1.0, 3.0])) == verdicts.Estimate(2.0, 1.0)
    assert verdicts.mean_over_runs(np.array([2.0])) == verdicts.Estimate(2.0, None)


@pytest.mark.parametrize("values", [[], [[1.0, 2.0]], [1.0, np.nan]])
def test_mean_over_runs_refuses(values):
    with pytest.raises(ValueError, match=r"^values: "):
        verdicts.mean_over_runs(np.array(values))


def test_verdicts_refuse_what_they_cannot_judge():
    one = np.ones((1, 2))
    with pytest.raises(ValueError, match=r"^values: needs at least 2 runs"):
        verdicts.bias_verdict(one, np.eye(2), ("x", "y"), 0.05)
    with pytest.raises(ValueError, match=r"^values: "):
        verdicts.chi_square_verdict("NEES", np.array([np.nan]), 2, 0.05)
    with pytest.raises(ValueError, match=r"^values: "):
        verdicts.chi_square_verdict("NEES", np.array([]), 2, 0.05)
    with pytest.raises(ValueError, match=r"^values: "):
        verdicts.run_mean_verdict("NEES", np.array([1.0, -0.1, 1.0]), 0.9, 1.1, 0.05)
    with pytest.raises(ValueError, match=r"^lags: "):
        verdicts.autocorrelation(np.ones((5, 1)), np.eye(1), 5)
    with pytest.raises(ValueError, match=r"^valid: no two scans 1 apart"):
        verdicts.whiteness_verdict(np.ones((5, 1)), np.eye(1), 1, 0.05, np.array([True, False, True, False, True]))
    with pytest.raises(ValueError, match=r"^cov: no axis has variance"):
        verdicts.bias_verdict(np.ones((3, 1)), np.zeros((1, 1)), ("x",), 0.05)
    for value in (np.nan, np.inf):  # as of a scan without a return, which `valid` must say: it is no innovation of 0
        with pytest.raises(ValueError, match=r"^innovation: .*got 1 "):
            verdicts.whiteness_verdict(np.array([[1.0], [value], [2.0], [1.0]]), np.eye(1), 1, 0.05)
    with pytest.raises(ValueError, match=r"^values: .*got -2"):
        verdicts.chi_square_verdict("NEES", np.array([1.0, -2.0]), 2, 0.05)
    with pytest.raises(ValueError, match=r"^low: .*got 1.1"):
        verdicts.run_mean_verdict("NEES", np.array([1.0, 2.0]), 1.1, 0.9, 0.05)
    with pytest.raises(ValueError, match=r"^axes: .*got x$"):
        verdicts.bias_verdict(np.ones((3, 2)), np.eye(2), ("x",), 0.05)
    with pytest.raises(ValueError, match=r"^error: needs more runs than axes"):
        noncredibility(np.ones((2, 2)), np.eye(2))


def test_no_band_of_squares_reaches_below_zero():
    """Ten runs of a heavy-tailed NEES have a wide band; what cannot be negative has none below 0, and the verdict stands."""
    values = np.r_[np.full(9, 0.2), 8.2]
    one, free = (verdicts.run_mean_verdict("NEES", values, 0.9, 1.1, 1e-6, least) for least in (0.0, -np.inf))
    assert free.low < 0
    assert one.low == 0
    assert (one.figure, one.inside) == (free.figure, free.inside)
    assert "band -" not in one.text
    assert verdicts.run_mean_verdict("NEES", values, 0.9, 1.1, 1e-6) == one


@pytest.mark.costly
@pytest.mark.parametrize("tail", [0.1, 1.0, 2.5])
def test_what_a_mean_is_at_least_errs_with_alpha_at_most_whatever_the_tail(tail):
    """500 sets of 50 log-normal numbers of mean 1; of numbers 3 times as large it is 3 times as much."""
    values = np.exp(tail * np.random.default_rng(6).normal(size=(500, 50)) - tail**2 / 2)
    least = np.array([verdicts.least_mean(row, 0.05) for row in values])
    assert np.count_nonzero(least > 1.0) <= 0.05 * len(least) + Z * np.sqrt(0.05 * 0.95 * len(least))
    assert np.all(least <= values.mean(axis=1))
    assert verdicts.least_mean(3 * values[0], 0.05) == pytest.approx(3 * least[0])
    assert verdicts.least_mean(np.zeros(5), 0.05) == 0.0


def test_a_few_runs_that_are_far_off_do_not_excuse_the_others():
    """Of 200 runs 180 are twice too large, and 20 so much larger that three standard errors of the mean reach below 0."""
    values = np.r_[np.full(180, 2.0), np.geomspace(10.0, 5000.0, 20)]
    free, one = (verdicts.run_mean_verdict("NEES", values, 0.85, 1.15, 1e-7, least) for least in (-np.inf, 0.0))
    assert free.inside
    assert not one.inside
    assert 1.5 < values.mean() - (one.high - 1.15) < 10


def test_what_is_inside_of_a_wide_band_is_not_shown():
    """Means of 1, with standard errors of .02 and .2: at 1e-7 the second excludes no covariance that is off by 2."""
    narrow, wide = (np.tile([1 - off, 1 + off], 50) for off in (0.2, 0.99))
    wide = np.r_[wide, 20.0, np.full(19, 0.0)]
    one, other = (verdicts.run_mean_verdict("NEES", values, 0.85, 1.15, 1e-7) for values in (narrow, wide))
    assert one.inside
    assert one.shown
    assert other.inside
    assert not other.shown
