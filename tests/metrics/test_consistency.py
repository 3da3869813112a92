"""Consistency statistics: against textbook formulas, by their size on right filters, and by their power on wrong ones.

Statistical tests are seeded; their false-alarm rate is what a new seed would risk. Z is the normal quantile for 1e-7.
"""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.special import chdtr, stdtr

from vedette.metrics import consistency as c

ALPHA = 1e-7
Z = 5.33


def covariances(rng, *shape, orders=4):
    """Positive definite matrices with axes of unlike size, `orders` of magnitude up and down, as position and turn rate."""
    root = rng.normal(size=(*shape, shape[-1]))
    size = 10.0 ** rng.uniform(-orders, orders, size=shape[-1])
    return (root @ np.swapaxes(root, -1, -2) + 0.1 * np.eye(shape[-1])) * size[:, None] * size


def draw(rng, cov, count):
    """`count` errors of a right filter."""
    return rng.normal(size=(count, len(cov))) @ np.linalg.cholesky(cov).T


seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


# NEES


@given(seeds, st.integers(1, 5))
@settings(derandomize=True, max_examples=50, deadline=None)
def test_nees_is_the_quadratic_form_and_a_batch_is_a_loop(rng, n):
    cov = covariances(rng, 3, 2, n)
    error = rng.normal(size=(3, 2, n)) * np.sqrt(np.diagonal(cov, axis1=-2, axis2=-1))
    batch = c.nees(error, cov)
    for i in np.ndindex(3, 2):
        assert batch[i] == pytest.approx(error[i] @ np.linalg.solve(cov[i], error[i]), rel=1e-8)
        assert batch[i] == pytest.approx(c.nees(error[i], cov[i]), rel=1e-12)


@given(seeds)
@settings(derandomize=True, max_examples=30, deadline=None)
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
    assert c.normalised_error(error, cov)[1] == 0
    assert c.nees(error, np.zeros((3, 3))) == 0


def test_arguments_are_left_as_they_were():
    error, cov = np.ones((3, 2)), np.broadcast_to(np.diag([1.0, 0.0]), (3, 2, 2))
    error.flags.writeable = False
    assert np.array_equal(c.nees(error, cov), np.ones(3))


@pytest.mark.parametrize("cov", [[[1.0, 2.0], [2.0, 1.0]], [[-1.0, 0.0], [0.0, 1.0]], [[np.nan, 0.0], [0.0, 1.0]]])
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


def test_sizes_of_the_exact_verdicts():
    """False alarms on 2,000 right sets of 30 runs at 5 %: chi-square, bias and every axis' calibration."""
    rng = np.random.default_rng(2)
    cov = covariances(rng, 3)
    nees, bias, axis, mean = [], [], [], []
    for _ in range(2000):
        error = draw(rng, cov, 30)
        nees.append(not c.chi_square_verdict("NEES", c.nees(error, cov), 3, 0.05).inside)
        bias.append(not c.bias_verdict(error[:, :1], cov[:1, :1], ("x",), 0.05).inside)
        axis.append(not c.calibration_verdicts(error, cov, ("x", "y", "z"), 0.15)[1].inside)
        mean.append(not c.run_mean_verdict("mean", 1 + error[:, 0] / np.sqrt(cov[0, 0]), 1.0, 1.0, 0.05).inside)
    assert within_its_size(nees, 0.05)
    assert within_its_size(bias, 0.05)
    assert within_its_size(axis, 0.05)
    assert within_its_size(mean, 0.05)


def test_size_of_the_worst_of_several_axes_and_lags():
    """The family of axes or lags alarms with alpha at most, and not much less."""
    rng = np.random.default_rng(3)
    bias, white = [], []
    for _ in range(2000):
        bias.append(not c.bias_verdict(rng.normal(size=(30, 3)), np.eye(3), ("x", "y", "z"), 0.05).inside)
        white.append(not c.whiteness_verdict(rng.normal(size=(4, 50, 2)), np.eye(2), 5, 0.05).inside)
    assert 0.02 < np.mean(bias) < 0.05 + Z * np.sqrt(0.05 * 0.95 / 2000)
    assert 0.02 < np.mean(white) < 0.05 + Z * np.sqrt(0.05 * 0.95 / 2000)


def test_a_covariance_wrong_by_half_is_found_and_told():
    """500 runs of 2 axes: the half-width at 1e-7 is 5.33 sqrt(2 / 1000) = 24 %."""
    rng = np.random.default_rng(4)
    cov = covariances(rng, 2)
    error = draw(rng, cov, 500)
    assert c.chi_square_verdict("NEES", c.nees(error, cov), 2, ALPHA).inside
    small = c.chi_square_verdict("NEES", c.nees(error, cov / 1.5), 2, ALPHA)
    large = c.chi_square_verdict("NEES", c.nees(error, cov * 1.5), 2, ALPHA)
    assert not small.inside
    assert "the covariance is 1.5 times too small" in small.text
    assert not large.inside
    assert "the covariance is 1.5 times too large" in large.text


def test_degrees_of_freedom_may_differ_from_value_to_value():
    values, dof = np.array([1.0, 4.0, 10.0]), np.array([1.0, 2.0, 2.0])
    verdict = c.chi_square_verdict("NIS", values, dof, 0.05)
    assert verdict.figure == 3.0
    assert (verdict.low, verdict.high) == c.chi_square_band(5, 0.05)


# Means over runs


def test_run_mean_and_equivalence_by_hand():
    values = np.array([1.0, 1.2, 1.1, 1.3])
    error = np.sqrt(((values - 1.15) ** 2).sum() / 3 / 4)
    lenient, strict = (f("ANEES", values, 0.9, 1.1, 0.05) for f in (c.run_mean_verdict, c.equivalence_verdict))
    assert lenient.error == pytest.approx(error)
    assert lenient.figure == pytest.approx(1.15)
    assert stdtr(3, (0.9 - lenient.low) / error) == pytest.approx(1 - 0.05 / 2)
    assert lenient.high - 1.1 == pytest.approx(0.9 - lenient.low)
    assert lenient.inside
    assert not strict.inside
    assert "too few runs" in strict.text
    assert strict.low == pytest.approx(0.9 + lenient.high - 1.1)


def test_run_mean_lets_the_edge_of_its_band_pass_and_equivalence_does_not():
    """Runs whose true mean is the band's edge: each verdict errs in alpha / 2 of the sets."""
    rng = np.random.default_rng(5)
    values = 1.1 + 0.3 * rng.normal(size=(4000, 50))
    wrongly_out = [not c.run_mean_verdict("m", row, 0.9, 1.1, 0.1).inside for row in values]
    wrongly_in = [c.equivalence_verdict("m", row, 0.7, 1.1, 0.1).inside for row in values]
    assert within_its_size(wrongly_out, 0.05)
    assert within_its_size(wrongly_in, 0.05)


def test_mean_over_runs():
    assert c.mean_over_runs(np.array([1.0, 3.0])) == c.Estimate(2.0, 1.0)
    assert c.mean_over_runs(np.array([2.0])) == c.Estimate(2.0, None)


@pytest.mark.parametrize("values", [[], [[1.0, 2.0]], [1.0, np.nan]])
def test_mean_over_runs_refuses(values):
    with pytest.raises(ValueError, match=r"^values: "):
        c.mean_over_runs(np.array(values))


def test_verdicts_refuse_what_they_cannot_judge():
    one = np.ones((1, 2))
    with pytest.raises(ValueError, match=r"^values: needs at least 2 runs"):
        c.bias_verdict(one, np.eye(2), ("x", "y"), 0.05)
    with pytest.raises(ValueError, match=r"^values: "):
        c.chi_square_verdict("NEES", np.array([np.nan]), 2, 0.05)
    with pytest.raises(ValueError, match=r"^values: "):
        c.chi_square_verdict("NEES", np.array([]), 2, 0.05)
    with pytest.raises(ValueError, match=r"^lags: "):
        c.autocorrelation(np.ones((5, 1)), np.eye(1), 5)
    with pytest.raises(ValueError, match=r"^valid: no two scans 1 apart"):
        c.whiteness_verdict(np.ones((5, 1)), np.eye(1), 1, 0.05, np.array([True, False, True, False, True]))
    with pytest.raises(ValueError, match=r"^cov: no axis has variance"):
        c.bias_verdict(np.ones((3, 1)), np.zeros((1, 1)), ("x",), 0.05)
    with pytest.raises(ValueError, match=r"^error: needs more runs than axes"):
        c.noncredibility(np.ones((2, 2)), np.eye(2))


# NIS under a gate and under association weights


@pytest.mark.parametrize("m", [1, 2, 3, 4])
@pytest.mark.parametrize("probability", [0.5, 0.9, 0.99])
def test_gate_truncation_is_the_mean_of_a_cut_chi_square(m, probability):
    from scipy.special import chdtri, gamma

    gate = chdtri(m, 1 - probability)
    density = lambda x: x ** (m / 2 - 1) * np.exp(-x / 2) / (2 ** (m / 2) * gamma(m / 2))  # noqa: E731
    mean = quad(lambda x: x * density(x), 0, gate)[0] / probability
    assert c.gate_truncation(m, probability) == pytest.approx(mean / m, rel=1e-6)
    assert c.gate_truncation(m, 1.0) == 1.0


def weighted_scans(rng, count, p_detect, p_gate, density):
    """NIS and hits of PDA on its own truth: one target, S = I in the plane, Poisson clutter in the gate."""
    gate = -2 * np.log(1 - p_gate)
    nis, hit = np.zeros(count), np.zeros(count)
    for s in range(count):
        clutter = gate * rng.uniform(size=rng.poisson(density * np.pi * gate))
        target = 2 * rng.exponential(size=int(rng.uniform() < p_detect))
        squared = np.concatenate([clutter, target[target < gate]])
        likelihood = p_detect * np.exp(-squared / 2) / (2 * np.pi) / density
        weights = likelihood / (1 - p_detect * p_gate + likelihood.sum())
        nis[s], hit[s] = weights @ squared, weights.sum()
    return nis, hit


def test_weighted_nis_is_one_on_matched_truth():
    """Under PDA in clutter, at 1e-7; without the truncation, or counting scans instead of hits, it is not."""
    rng = np.random.default_rng(6)
    nis, hit = weighted_scans(rng, 20_000, p_detect=0.8, p_gate=0.9, density=0.1)

    def off(axes, gate):
        rest = nis - hit * axes * c.gate_truncation(axes, gate)
        return abs(rest.mean()) / (rest.std() / np.sqrt(len(rest)))

    ratio = c.pooled_nis(nis, hit, 2, 0.9)
    assert off(2, 0.9) < Z
    assert off(2, 1.0) > 2 * Z
    assert ratio == pytest.approx(1, abs=0.05)
    assert c.pooled_nis(nis, np.ones_like(hit), 2, 0.9) < 0.9


def test_pooled_nis_by_hand():
    nis, hit, axes = np.array([[2.0, 1.5], [0.0, 0.0]]), np.array([[1.0, 0.5], [0.0, 0.0]]), np.array([2, 1])
    ratio = c.pooled_nis(nis, hit, axes)
    assert ratio[0] == pytest.approx(3.5 / 2.5)
    assert np.isnan(ratio[1])


# Whiteness


def test_autocorrelation_is_its_definition():
    rng = np.random.default_rng(7)
    cov = np.stack([covariances(rng, 2) for _ in range(6)])
    nu, valid = rng.normal(size=(3, 6, 2)), rng.uniform(size=(3, 6)) < 0.8
    rho, count = c.autocorrelation(nu, cov, 3, valid)
    for lag in (1, 2, 3):
        top = first = second = pairs = 0
        for r in range(3):
            for k in range(6 - lag):
                if valid[r, k] and valid[r, k + lag]:
                    u, v = (np.linalg.solve(np.linalg.cholesky(cov[i]), nu[r, i]) for i in (k, k + lag))
                    top, first, second, pairs = top + u @ v, first + u @ u, second + v @ v, pairs + 2
        assert rho[lag - 1] == pytest.approx(top / np.sqrt(first * second), rel=1e-9)
        assert count[lag - 1] == pairs


def test_correlated_innovations_are_found_at_their_lag():
    rng = np.random.default_rng(8)
    white = rng.normal(size=(20, 100, 2))
    late = white.copy()
    late[:, 3:] += 0.4 * white[:, :-3]
    assert c.whiteness_verdict(9 * white, np.eye(2), 5, ALPHA).inside
    verdict = c.whiteness_verdict(late, np.eye(2), 5, ALPHA)
    assert not verdict.inside
    assert "not white" in verdict.text
    assert "lag 3" in verdict.text


def test_innovations_that_vanish_are_white():
    assert c.whiteness_verdict(np.zeros((10, 1)), np.eye(1), 2, 0.05).figure == 0


# Bias, calibration, credibility


def test_bias_is_found_in_its_axis_and_a_wrong_scale_is_none():
    rng = np.random.default_rng(9)
    cov = np.diag([1.0, 0.0, 100.0])
    error = rng.normal(size=(400, 3)) * [1.0, 0.0, 10.0]
    axes = ("x", "heading", "vx")
    assert c.bias_verdict(error, cov / 9, axes, ALPHA).inside
    verdict = c.bias_verdict(error + np.array([0.0, 5.0, 5.0]), cov, axes, ALPHA)
    assert not verdict.inside
    assert verdict.figure == pytest.approx(0.5, abs=0.3)
    assert "the mean error of vx" in verdict.text


def test_a_constant_error_is_a_bias():
    assert not c.bias_verdict(np.full((5, 1), 0.5), np.eye(1), ("x",), ALPHA).inside


def test_calibration_names_the_axis():
    rng = np.random.default_rng(10)
    cov = np.diag([1.0, 0.0, 4.0])
    error = rng.normal(size=(1000, 3)) * [1.0, 0.0, np.sqrt(4.0 * 1.8)]
    x, vx = c.calibration_verdicts(error, cov, ("x", "heading", "vx"), ALPHA)
    assert x.inside
    assert not vx.inside
    assert vx.text.startswith("variance of vx: ")
    assert vx.figure == pytest.approx(1.8, abs=1.8 * Z * np.sqrt(2 / 1000))


@given(seeds)
@settings(derandomize=True, max_examples=20, deadline=None)
def test_credibility_reads_in_decibels(rng):
    """With P the mean square error itself the indices vanish; a factor moves them by its decibels, whatever the axes."""
    error = draw(rng, covariances(rng, 3), 20)
    square = error.T @ error / 20
    exact, half, double = (c.noncredibility(error, square * k) for k in (1.0, 0.5, 2.0))
    assert exact.index == pytest.approx(0, abs=1e-6)
    assert (half.index, half.inclination) == pytest.approx((10 * np.log10(2), 10 * np.log10(2)), abs=1e-6)
    assert (double.index, double.inclination) == pytest.approx((10 * np.log10(2), -10 * np.log10(2)), abs=1e-6)


def test_credibility_of_a_mixed_fault_does_not_cancel():
    """One axis too small and one too large: the inclination hides it, the index does not. Times are separate."""
    rng = np.random.default_rng(11)
    error = rng.normal(size=(2, 4000, 2))
    mixed = c.noncredibility(error, np.diag([0.25, 4.0]))
    right = c.noncredibility(error, np.eye(2))
    assert right.index < 0.2
    assert mixed.index > 2
    one, two = (c.noncredibility(part, np.eye(2)) for part in error)
    assert right.index == pytest.approx((one.index + two.index) / 2, rel=1e-9)
    zero_variance = c.noncredibility(np.concatenate([error, error[..., :1]], axis=-1), np.diag([1.0, 1.0, 0.0]))
    assert zero_variance.index == pytest.approx(right.index, rel=1e-9)


# A Kalman filter on matched truth, and its mutants


def kalman_run(rng, runs=2000, steps=40, q_scale=1.0, r_scale=1.0, p_scale=1.0, slip=0.0):
    """Truth drawn from constant velocity, and a filter that believes in scaled noises; `slip` biases its measurements."""
    F, H = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    Q, R, P = 0.5 * np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]]), np.array([[4.0]]), np.diag([9.0, 1.0])
    x, m = draw(rng, P, runs), np.zeros((runs, 2))
    innovations, variances = [], []
    for _ in range(steps):
        x = x @ F.T + draw(rng, Q, runs)
        z = x @ H.T + draw(rng, R, runs) + slip
        m, P = m @ F.T, F @ P @ F.T + q_scale * Q
        S = H @ P @ H.T + r_scale * R
        K = P @ H.T @ np.linalg.inv(S)
        innovations.append(z - m @ H.T)
        variances.append(S)
        m = m + innovations[-1] @ K.T
        P = p_scale * (P - K @ H @ P)
    return m - x, P, np.stack(innovations, axis=1), np.stack(variances)


def verdicts_of(error, P, nu, S):
    return [
        c.chi_square_verdict("NEES", c.nees(error, P), 2, ALPHA),
        c.chi_square_verdict("NIS", c.nees(nu, S), 1, ALPHA),
        c.whiteness_verdict(nu, S, 5, ALPHA),
        c.bias_verdict(error, P, ("x", "vx"), ALPHA),
        *c.calibration_verdicts(error, P, ("x", "vx"), ALPHA),
    ]


def test_a_matched_kalman_filter_passes():
    """All six verdicts; false-alarm rate 6e-7 together."""
    for verdict in verdicts_of(*kalman_run(np.random.default_rng(12))):
        assert verdict.inside, verdict.text


@pytest.mark.parametrize(
    ("mutant", "found"),
    [
        ({"q_scale": 0.5}, ("NEES", "NIS", "whiteness", "variance of vx")),
        ({"r_scale": 2.0}, ("NEES", "NIS", "whiteness")),
        ({"p_scale": 1.5}, ("NEES", "NIS", "whiteness")),
        ({"p_scale": 0.7}, ("NEES", "whiteness")),
        ({"slip": 1.0}, ("bias",)),
    ],
    ids=["Q halved", "R doubled", "P too large", "P too small", "biased measurements"],
)
def test_a_mutant_of_the_kalman_filter_does_not(mutant, found):
    alarms = {
        verdict.name for verdict in verdicts_of(*kalman_run(np.random.default_rng(13), **mutant)) if not verdict.inside
    }
    assert alarms.issuperset(found)
