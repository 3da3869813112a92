"""A smoothed IMM is near the enumeration of all mode sequences, exact where that is defined, and consistent."""

import numpy as np
import pytest

from support.enumeration import drawn, enumerated, smoothed_imm
from support.models import Linear, Looking
from support.smoothing import estimates, states_of, tracker_of
from vedette import Detections, Gaussian, Scan
from vedette.kernels import backward
from vedette.tracking.smoothing import smoothed
from vedette_standard.estimators import imm as imm_module
from vedette_standard.estimators import imm_backward
from vedette_standard.estimators.imm import Imm
from vedette_standard.estimators.kalman import Kalman

REAL = {
    "smooth_step": backward.smooth_step,
    "future_likelihood": imm_backward.future_likelihood,
    "pair_posterior": imm_backward.pair_posterior,
}
STRAIGHT = np.array([[0.0, 1.0], [0.0, 0.0]])
WHITE = np.array([[1 / 3, 1 / 2], [1 / 2, 1.0]])
CASES = {
    "unlike noise": (Linear(STRAIGHT, 0.01 * WHITE), Linear(STRAIGHT, 4.0 * WHITE), np.array([[0.9, 0.1], [0.2, 0.8]])),
    "brakes": (
        Linear(STRAIGHT, 0.02 * WHITE),
        Linear(np.array([[0.0, 1.0], [0.0, -0.7]]), 0.02 * WHITE),
        np.array([[0.8, 0.2], [0.2, 0.8]]),
    ),
}
PRIOR = Gaussian(np.zeros((1, 2)), 4.0 * np.eye(2)[None])
SEEN = Looking(np.array([[1.0, 0.0]]), np.eye(1), p=0.5)
"""With p = 1/2 a miss says the same in every mode, as does a return: the modes' P_D is one."""


@pytest.mark.parametrize("case", CASES)
def test_one_scan_after_a_common_prior_it_is_the_exact_mixture(case):
    *models, transition = CASES[case]
    _, zs = drawn(models, transition, SEEN, PRIOR, [1.3], 6, 1, missed=0.0)
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    _, mean, cov, prob = smoothed_imm(imm, SEEN, PRIOR, [1.3], zs)
    expected = enumerated(models, transition, SEEN, PRIOR, [1.3], zs)
    for found, exact in zip((mean, cov, prob), expected, strict=True):
        np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-10)


def check_near_enumeration(case):
    """The means' squared distance in units of the exact covariance, the covariances' ratio, the probabilities' error."""
    *models, transition = CASES[case]
    dts = [1.0, 0.7, 1.0, 1.5, 1.0, 0.5]
    _, zs = drawn(models, transition, SEEN, PRIOR, dts, 100, 2)
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    _, mean, cov, prob = smoothed_imm(imm, SEEN, PRIOR, dts, zs)
    exact_mean, exact_cov, exact_prob = enumerated(models, transition, SEEN, PRIOR, dts, zs)
    apart = mean - exact_mean
    distance = np.mean(np.sum(apart * np.linalg.solve(exact_cov, apart[..., None])[..., 0], -1)) / 2
    ratio = np.mean(np.trace(np.linalg.solve(exact_cov, cov), axis1=-2, axis2=-1)) / 2
    wrong = np.mean(np.abs(prob - exact_prob))
    assert distance < 0.03
    assert abs(ratio - 1) < 0.1
    assert wrong < 0.05


@pytest.mark.parametrize("case", CASES)
def test_on_short_runs_it_is_near_enumeration_of_all_mode_sequences(case):
    check_near_enumeration(case)


def at_the_later_mean(predicted, origin, seen, state):
    """The later belief as it is for every pair, and the pair's density at its mean: what the integral replaces."""
    shift = np.swapaxes(seen.back @ (seen.pull / (1.0 + seen.info))[..., None], -1, -2)[..., 0, :]
    mean = np.broadcast_to(state.displace(origin, shift)[..., None, :], predicted.mean.shape)
    scaled = seen.back * (seen.growth / np.sqrt(1.0 + seen.info))[..., None, :]
    cov = np.broadcast_to((scaled @ np.swapaxes(scaled, -1, -2))[..., None, :, :], predicted.cov.shape)
    apart = state.difference(mean, predicted.mean)
    distance = np.sum(apart * np.linalg.solve(predicted.cov, apart[..., None])[..., 0], -1)
    return Gaussian(mean, cov), -0.5 * (distance + np.linalg.slogdet(predicted.cov)[1])


@pytest.mark.parametrize(
    "mutant",
    [
        lambda *given: (REAL["pair_posterior"](*given)[0], np.zeros(given[0].mean.shape[:-1])),
        lambda *given: (REAL["pair_posterior"](*given)[0], -REAL["pair_posterior"](*given)[1]),
        lambda *given: (given[0], REAL["pair_posterior"](*given)[1]),
        at_the_later_mean,
    ],
    ids=["no weights", "weights upside down", "nothing learnt", "one point"],
)
def test_the_comparison_with_enumeration_finds_wrong_pairs(monkeypatch, mutant):
    monkeypatch.setattr(imm_module, "pair_posterior", mutant)
    with pytest.raises(AssertionError):
        check_near_enumeration("unlike noise")


def matched(estimator, models, transition, prior, runs, count, seed):
    """Mean squared position errors (runs,) of filter and smoother, and the smoother's NEES (runs,), on matched truth."""
    sensor = Looking(np.array([[1.0, 0.0]]), 4.0 * np.eye(1), p=0.5)
    dts = np.tile([1.0, 0.5, 2.0, 1.0], count // 4)
    truth, zs = drawn(models, transition, sensor, prior, dts, runs, seed)
    before, mean, cov, _ = smoothed_imm(estimator, sensor, prior, dts, zs)
    error = mean - truth
    nees = np.sum(error * np.linalg.solve(cov, error[..., None])[..., 0], -1)
    errors = [np.mean((found - truth)[:, 1:, 0] ** 2, axis=1) for found in (before, mean)]
    return (*errors, np.mean(nees[:, 1:], axis=1))


def test_on_jump_markov_truth_the_imm_gains_and_its_covariance_stays_right():
    """The gain is judged on differences within a run, the NEES on run means; both with the run as the unit.

    False alarms: six standard errors of 300 runs, about 2e-9 each.
    """
    *models, transition = CASES["unlike noise"]
    imm = Imm(tuple(Kalman(model) for model in models), transition=transition)
    before, after, nees = matched(imm, models, transition, PRIOR, 300, 40, 5)
    gain = before - after
    error = np.std(gain, ddof=1) / np.sqrt(len(gain))
    assert np.mean(gain) > 0.5 * np.mean(before) - 6 * error
    assert np.mean(gain) > 6 * error
    assert abs(np.mean(nees) / 2 - 1) < 0.1 + 6 * np.std(nees / 2, ddof=1) / np.sqrt(len(nees))


def test_a_mode_that_cannot_be_and_one_that_cannot_be_reached_do_no_harm():
    modes = tuple(Kalman(model) for model in CASES["unlike noise"][:2])
    tracker = tracker_of(Imm(modes, transition=[[1.0, 0.0], [1.0, 0.0]]), {"s": SEEN})
    plain = tracker_of(modes[0], {"s": SEEN})
    scans = [Scan(float(k), "s", Detections.of([[0.5 * k]])) for k in range(1, 6)]
    found = estimates(tracker, smoothed(tracker, states_of(tracker, PRIOR, scans)))
    expected = estimates(plain, smoothed(plain, states_of(plain, PRIOR, scans)))
    for one, other in zip(found, expected, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
