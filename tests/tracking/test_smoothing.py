"""Smoothing on linear problems is conditioning on all scans, or on those within the lag."""

from fractions import Fraction

import numpy as np
import pytest

from support.models import Linear, Looking
from support.smoothing import conditioned, estimates, random_problem, states_of, tracker_of
from vedette import Detections, Gaussian, Scan, kernels
from vedette.kernels import backward
from vedette.kernels.results import Step
from vedette.tracking.smoothing import smoothed
from vedette_standard.estimators import imm_backward
from vedette_standard.estimators.cubature import CubatureKalman
from vedette_standard.estimators.extended import ExtendedKalman
from vedette_standard.estimators.gaussian_sum import GaussianSum
from vedette_standard.estimators.iterated import IteratedExtendedKalman
from vedette_standard.estimators.kalman import Kalman
from vedette_standard.estimators.square_root import SquareRootKalman
from vedette_standard.estimators.unscented import UnscentedKalman
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition

ALL = [Kalman, ExtendedKalman, UnscentedKalman, IteratedExtendedKalman, CubatureKalman, SquareRootKalman]


def check_exact(kinds=ALL, seeds=range(25)):
    for seed in seeds:
        motion, sensors, prior, scans = random_problem(seed)
        mean, cov = conditioned(motion, sensors, prior, scans)
        scale = np.abs(cov).max()
        for kind in kinds:
            tracker = tracker_of(kind(motion), sensors)
            states = states_of(tracker, prior, scans)
            means, covs = estimates(tracker, smoothed(tracker, states))
            np.testing.assert_allclose(means[:, 0], mean, rtol=1e-9, atol=1e-9)
            np.testing.assert_allclose(covs[:, 0], cov, rtol=1e-9, atol=1e-9 * max(scale, 1.0))
            _, before = estimates(tracker, states)
            np.testing.assert_array_equal(covs, np.swapaxes(covs, -1, -2))
            assert np.linalg.eigvalsh(covs).min() > 0
            assert np.linalg.eigvalsh(before - covs).min() > -1e-9 * scale


@pytest.mark.costly
def test_on_linear_problems_it_is_the_joint_gaussians_conditional_and_never_less_certain_than_the_filter():
    check_exact()


REAL = {
    "smooth_step": backward.smooth_step,
    "future_likelihood": imm_backward.future_likelihood,
    "pair_posterior": imm_backward.pair_posterior,
}


@pytest.mark.parametrize(
    "mutant",
    [
        lambda P, ahead, cross, step, later, how: REAL["smooth_step"](
            P, ahead, np.swapaxes(cross, -1, -2), step, later, how
        ),
        lambda P, ahead, cross, step, later, how: REAL["smooth_step"](P, ahead, cross, 0.99 * step, later, how),
        lambda P, ahead, cross, step, later, how: REAL["smooth_step"](P, ahead, cross, step, ahead, how),
        lambda P, ahead, cross, step, later, how: REAL["smooth_step"](P, ahead, cross, step, later, how)._replace(cov=P),
        lambda P, ahead, cross, step, later, how: Step(0 * step, P),
    ],
    ids=["transposed", "short step", "nothing learnt of the covariance", "filter's covariance", "filter"],
)
def test_the_comparison_finds_a_wrong_step_back(monkeypatch, mutant):
    monkeypatch.setattr(backward, "smooth_step", mutant)
    monkeypatch.setattr(kernels, "smooth_linear", backward.smooth_linear)
    with pytest.raises(AssertionError):
        check_exact([Kalman])


def test_a_filter_that_is_smoothed_by_its_cross_covariance_needs_the_right_one(monkeypatch):
    monkeypatch.setattr(UnscentedKalman, "linearises", False)
    check_exact([UnscentedKalman], range(3))
    real = UnscentedKalman.cross_covariance
    monkeypatch.setattr(UnscentedKalman, "cross_covariance", lambda self, belief, dt: real(self, belief, 0.9 * dt))
    with pytest.raises(AssertionError):
        check_exact([UnscentedKalman])


def test_a_gaussian_sum_is_the_mixture_of_its_parts_own_conditionals():
    """Parts never switch: each is smoothed alone, and weighs what all scans leave it."""
    motion, sensors, prior, scans = random_problem(6)
    estimator = GaussianSum(Kalman(motion), parts=3)
    tracker = tracker_of(estimator, sensors)
    states = states_of(tracker, prior, scans)
    found = estimates(tracker, smoothed(tracker, states))
    start = states[0].belief
    parts = [conditioned(motion, sensors, part, scans) for part in start.beliefs]
    weights = estimator.mode_prob(states[-1].belief)[0]
    means, covs = np.stack([part[0] for part in parts]), np.stack([part[1] for part in parts])
    mean = np.einsum("q,qkn->kn", weights, means)
    apart = means - mean
    cov = np.einsum("q,qkab->kab", weights, covs + apart[..., :, None] * apart[..., None, :])
    np.testing.assert_allclose(found[0][:, 0], mean, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[1][:, 0], cov, rtol=1e-8, atol=1e-9)


def check_lag(lag, seeds=range(8)):
    for seed in seeds:
        motion, sensors, prior, scans = random_problem(seed)
        tracker = tracker_of(Kalman(motion), sensors)
        states = states_of(tracker, prior, scans)
        means, covs = estimates(tracker, smoothed(tracker, states, lag))
        mean, cov = conditioned(motion, sensors, prior, scans, lag)
        np.testing.assert_allclose(means[:, 0], mean, rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(covs[:, 0], cov, rtol=1e-9, atol=1e-9 * max(np.abs(cov).max(), 1.0))


@pytest.mark.parametrize("lag", [0.0, 0.7, 1.5, 4.0])
def test_a_fixed_lag_is_conditioning_on_the_scans_inside_it(lag):
    """Lag 0 still joins the scans of one moment."""
    check_lag(lag)


def test_a_lag_of_the_whole_span_or_more_is_the_whole_recording():
    motion, sensors, prior, scans = random_problem(3)
    tracker = tracker_of(UnscentedKalman(motion), sensors)
    states = states_of(tracker, prior, scans)
    for one, other in zip(smoothed(tracker, states, scans[-1].time), smoothed(tracker, states), strict=True):
        np.testing.assert_array_equal(one.belief.mean, other.belief.mean)
        np.testing.assert_array_equal(one.belief.cov, other.belief.cov)


def test_a_state_comes_back_as_soon_as_its_lag_is_over():
    tracker = tracker_of(Kalman(Linear(np.zeros((1, 1)), np.eye(1))), {"s": Looking(np.eye(1), np.eye(1))})
    scans = [Scan(float(time), "s", Detections.of([[1.0]])) for time in range(1, 7)]
    states = states_of(tracker, Gaussian(np.zeros((1, 1)), np.ones((1, 1, 1))), scans)
    read = []

    def live():
        for state in states:
            read.append(state.time)
            yield state

    seen = [(state.time, read[-1]) for state in smoothed(tracker, live(), 2.0)]
    assert seen == [(0, 3), (1, 4), (2, 5), (3, 6), (4, 6), (5, 6), (6, 6)]


LONG_GAPS = {"a day, then 1 s": (86_400.0, 1.0), "a day, then 1 ms": (86_400.0, 2.0**-10), "an hour": (3600.0, 0.125)}
UNSEEN = (5, 6)
"""The scans without a return: after the gap and the step behind it."""


def by_longer_numbers(gaps, sigma, noise):
    """Smoothed covariances (s, 2, 2) of one axis, by Rauch, Tung and Striebel in fractions: no digit is lost."""

    def exact(rows):
        return np.array([[Fraction(value) for value in row] for row in rows])

    def step(T):
        T, q = Fraction(T), Fraction(sigma) ** 2
        return exact([[1, T], [0, 1]]), q * exact([[T**3 / 3, T**2 / 2], [T**2 / 2, T]])

    P = exact([[100.0, 0.0], [0.0, 100.0]])
    filtered, ahead = [], []
    for k, gap in enumerate((0.0, *gaps)):
        F, Q = step(gap)
        P = F @ P @ F.T + Q
        ahead.append(P)
        if k not in UNSEEN:
            P = P - np.outer(P[:, 0], P[0]) / (P[0, 0] + Fraction(noise) ** 2)
        filtered.append(P)
    found = [filtered[-1]]
    for gap, now, later in zip(gaps[::-1], filtered[-2::-1], ahead[:0:-1], strict=True):
        (a, b), (_, d) = later
        inverse = exact([[d, -b], [-b, a]]) / (a * d - b * b)
        gain = now @ step(gap)[0].T @ inverse
        found.insert(0, now + gain @ (found[0] - later) @ gain.T)
    return np.array(found, dtype=float)


def check_long_gaps(kind, name):
    gaps = [1.0] * 4 + list(LONG_GAPS[name]) + [1.0] * 4
    times = np.concatenate([[0.0], np.cumsum(gaps)])
    motion, sensors = ConstantVelocity(0.05), {"s": CartesianPosition(8.0)}
    tracker = tracker_of(kind(motion), sensors)
    returns = [Detections.of([] if k in UNSEEN else [[0.0, 0.0]], 2) for k in range(len(times))]
    scans = [Scan(time, "s", seen) for time, seen in zip(times.tolist(), returns, strict=True)]
    states = states_of(tracker, Gaussian(np.zeros((1, 4)), 100.0 * np.eye(4)[None]), scans)
    _, covs = estimates(tracker, smoothed(tracker, states))
    found = covs[-len(times) :, 0][:, ::2, ::2]
    wanted = by_longer_numbers(np.diff(times).tolist(), 0.05, 8.0)
    scale = np.sqrt(np.einsum("kii->ki", wanted))
    scale = scale[:, :, None] * scale[:, None]
    np.testing.assert_allclose(found / scale, wanted / scale, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", LONG_GAPS)
@pytest.mark.parametrize("kind", [Kalman, UnscentedKalman, SquareRootKalman])
def test_after_a_long_gap_it_keeps_its_digits(kind, name):
    """What the step back leaves open is a part in 1e15 of what the gap made of the variance, and matters."""
    check_long_gaps(kind, name)


def test_the_long_gap_finds_a_difference_of_large_numbers(monkeypatch):
    plain = backward.smooth_step
    monkeypatch.setattr(backward, "smooth_step", lambda *args: plain(*args[:5]))
    monkeypatch.setattr(kernels, "smooth_linear", backward.smooth_linear)
    with pytest.raises(AssertionError):
        check_long_gaps(Kalman, "a day, then 1 s")
