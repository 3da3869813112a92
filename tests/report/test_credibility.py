"""Whiteness, bias, calibration and credibility, and Kalman filters with one thing wrong."""

import numpy as np
import pytest
from hypothesis import given, settings

from support.gaussians import covariances, draw, seeds
from vedette.metrics import consistency as c
from vedette_report import consistency as verdicts
from vedette_report.recorded.credibility import noncredibility
from vedette_study.over_runs import calibration_verdicts

ALPHA = 1e-7
Z = 5.33


# Whiteness
def test_autocorrelation_is_its_definition():
    rng = np.random.default_rng(7)
    cov = np.stack([covariances(rng, 2) for _ in range(6)])
    nu, valid = rng.normal(size=(3, 6, 2)), rng.uniform(size=(3, 6)) < 0.8
    rho, count = verdicts.autocorrelation(nu, cov, 3, valid)
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
    assert verdicts.whiteness_verdict(9 * white, np.eye(2), 5, ALPHA).inside
    verdict = verdicts.whiteness_verdict(late, np.eye(2), 5, ALPHA)
    assert not verdict.inside
    assert "not white" in verdict.text
    assert "lag 3" in verdict.text


def test_innovations_that_vanish_are_white():
    assert verdicts.whiteness_verdict(np.zeros((10, 1)), np.eye(1), 2, 0.05).figure == 0


# Bias, calibration, credibility
def test_bias_is_found_in_its_axis_and_a_wrong_scale_is_none():
    rng = np.random.default_rng(9)
    cov = np.diag([1.0, 0.0, 100.0])
    error = rng.normal(size=(400, 3)) * [1.0, 0.0, 10.0]
    axes = ("x", "heading", "vx")
    assert verdicts.bias_verdict(error, cov / 9, axes, ALPHA).inside
    verdict = verdicts.bias_verdict(error + np.array([0.0, 5.0, 5.0]), cov, axes, ALPHA)
    assert not verdict.inside
    assert verdict.figure == pytest.approx(0.5, abs=0.3)
    assert "the mean error of vx" in verdict.text


def test_a_constant_error_is_a_bias():
    assert not verdicts.bias_verdict(np.full((5, 1), 0.5), np.eye(1), ("x",), ALPHA).inside


def test_calibration_names_the_axis():
    rng = np.random.default_rng(10)
    cov = np.diag([1.0, 0.0, 4.0])
    error = rng.normal(size=(1000, 3)) * [1.0, 0.0, np.sqrt(4.0 * 1.8)]
    x, vx = calibration_verdicts(error, cov, ("x", "heading", "vx"), ALPHA)
    assert x.inside
    assert not vx.inside
    assert vx.text.startswith("variance of vx: ")
    assert vx.figure == pytest.approx(1.8, abs=1.8 * Z * np.sqrt(2 / 1000))


@given(seeds)
@settings(max_examples=20)
def test_credibility_reads_in_decibels(rng):
    """With P the mean square error itself the indices vanish; a factor moves them by its decibels, whatever the axes."""
    error = draw(rng, covariances(rng, 3), 20)
    square = error.T @ error / 20
    exact, half, double = (noncredibility(error, square * k) for k in (1.0, 0.5, 2.0))
    assert exact.index == pytest.approx(0, abs=1e-6)
    assert (half.index, half.inclination) == pytest.approx((10 * np.log10(2), 10 * np.log10(2)), abs=1e-6)
    assert (double.index, double.inclination) == pytest.approx((10 * np.log10(2), -10 * np.log10(2)), abs=1e-6)


def test_credibility_of_a_mixed_fault_does_not_cancel():
    """One axis too small and one too large: the inclination hides it, the index does not. Times are separate."""
    rng = np.random.default_rng(11)
    error = rng.normal(size=(2, 4000, 2))
    mixed = noncredibility(error, np.diag([0.25, 4.0]))
    right = noncredibility(error, np.eye(2))
    assert right.index < 0.2
    assert mixed.index > 2
    one, two = (noncredibility(part, np.eye(2)) for part in error)
    assert right.index == pytest.approx((one.index + two.index) / 2, rel=1e-9)
    zero_variance = noncredibility(np.concatenate([error, error[..., :1]], axis=-1), np.diag([1.0, 1.0, 0.0]))
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
        verdicts.chi_square_verdict("NEES", c.nees(error, P), 2, ALPHA),
        verdicts.chi_square_verdict("NIS", c.nees(nu, S), 1, ALPHA),
        verdicts.whiteness_verdict(nu, S, 5, ALPHA),
        verdicts.bias_verdict(error, P, ("x", "vx"), ALPHA),
        *calibration_verdicts(error, P, ("x", "vx"), ALPHA),
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
