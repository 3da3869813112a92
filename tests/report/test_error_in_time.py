"""White errors against correlated ones, found in returns without truth."""

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from vedette_report.detector_errors import pieces as in_pieces
from vedette_report.detector_errors.in_time import compared
from vedette_report.detector_errors.pieces import Fit, Path, Pieces

DT = 0.1


def wandering(rng, alike, deviation, count):
    """Return an error (s,) that is so much alike from one return to the next."""
    error = rng.normal(size=count) * deviation
    for i in range(1, count):
        error[i] = alike * error[i - 1] + np.sqrt(1 - alike**2) * error[i]
    return error


def straight(rng, alike, deviation, count=600, axes=8, white=0.0):
    """Return the paths of targets along some axes."""
    times = DT * np.arange(count)
    return [
        Path(times, rng.uniform(-9, 9) * times + wandering(rng, alike, deviation, count) + white * rng.normal(size=count))
        for _ in range(axes)
    ]


@pytest.mark.parametrize("memory", [np.inf, 2.0])
def test_the_likelihood_is_that_of_all_returns_at_once(memory):
    """Of the third return and those after it, by the whole covariance of returns at uneven times; the place is unknown."""
    rng = np.random.default_rng(1)
    times = np.cumsum(rng.uniform(0.5, 2.0, 24))
    path = Path(times, rng.normal(size=24))
    pieces = Pieces.of([path])
    fit = Fit(np.log(2.0), np.log(0.3), 0.5, 0.7, memory)
    t, tau, q = times - times[0], 2.0 * pieces.dt, 0.3 * 0.7 * (1 + 1 / memory) / pieces.dt**1.5
    early, late = np.minimum(t[:, None], t), np.maximum(t[:, None], t)
    speed = in_pieces.DIFFUSE * 0.7 * np.hypot(1.0, 0.5) / pieces.dt
    if np.isinf(memory):
        cov = speed**2 * t[:, None] * t + q**2 * (early**2 * late / 2 - early**3 / 6)
    else:  # the integral of a velocity that is forgotten, from 0, and of the first one
        T = memory * pieces.dt
        left, both = np.exp(-t / T), np.exp(-(late - early) / T) + np.exp(-(late + early) / T)
        cov = speed**2 * T**2 * np.outer(1 - left, 1 - left)
        cov += (q * T) ** 2 * (early - T * (1 - left[:, None] - left) - T / 2 * both)
    cov += 0.7**2 * (np.exp(-np.abs(t[:, None] - t) / tau) + 0.25 * np.eye(24))
    z = path.values - path.values[0]
    apart = np.diff(np.eye(24), axis=0)
    whole = [
        multivariate_normal(np.zeros(k - 1), (apart @ cov @ apart.T)[: k - 1, : k - 1]).logpdf(np.diff(z[:k]))
        for k in (2, 24)
    ]
    assert pieces.singles(fit).sum() == pytest.approx(whole[1] - whole[0], abs=1e-3)
    squares, logs = pieces.sums(*fit.parameters)
    each = -0.5 * (squares / 0.49 + logs + 22 * np.log(2 * np.pi * 0.49))
    assert pieces.singles(fit).sum() == pytest.approx(each[0])


@pytest.mark.by_turns
@pytest.mark.parametrize(("alike", "deviation"), [(0.3, 0.5), (0.7, 0.05)])
def test_a_correlated_error_is_found_with_its_size_and_time(alike, deviation):
    """Within four of its stated errors, which are some per cent."""
    found = compared(straight(np.random.default_rng(2), alike, deviation, axes=4))
    assert found.wins
    for value, error, truth in (
        (found.correlated.deviation, found.correlated.deviation_error, deviation),
        (found.correlated.tau, found.correlated.tau_error, -DT / np.log(alike)),
    ):
        assert error < 0.08
        assert abs(np.log(value / truth)) < 4.0 * error


@pytest.mark.costly
def test_a_white_part_is_told_from_a_correlated_one():
    found = compared(straight(np.random.default_rng(3), 0.8, 0.3, axes=4, white=0.3)).correlated
    assert found.correlated == pytest.approx(0.3, rel=0.15)
    assert found.white == pytest.approx(0.3, rel=0.15)


@pytest.mark.costly
def test_white_errors_of_targets_that_turn_are_not_called_correlated():
    rng, times = np.random.default_rng(4), DT * np.arange(600)
    paths = [Path(times, 30 * np.sin(times / 5 + i) + rng.normal(size=600)) for i in range(6)]
    assert not compared(paths).wins
    assert compared([Path(times[:10], times[:10])]) is None


@pytest.mark.costly
@pytest.mark.parametrize("keeps", [0.0, 0.6])
def test_what_wanders_is_not_called_an_error(keeps):
    """Brownian motion, which was held against nearly constant velocity alone, and a velocity that is forgotten."""
    rng, steps = np.random.default_rng(6), np.zeros((4, 300))
    for i in range(1, 300):
        steps[:, i] = keeps * steps[:, i - 1] + rng.normal(0, 2, 4)
    found = compared([Path(DT * np.arange(300), one + rng.normal(size=300)) for one in np.cumsum(steps, axis=1)])
    assert not found.wins


@pytest.mark.parametrize("places", [(100.0,), (100.0, 500.0)])
def test_positions_that_are_all_alike_have_no_errors(places):
    """As of a buoy whose place is read off a chart: errors of 6e-152 m were called correlated."""
    assert compared([Path(np.arange(150.0), np.full(150, place)) for place in places]) is None


@pytest.mark.filterwarnings("error")
def test_weeks_without_a_look_leave_the_errors_before_and_after_them():
    """As of a recording of two days, five weeks apart: variances below 0 ended in a warning of an invalid logarithm."""
    times, rng = np.arange(60.0), np.random.default_rng(5)
    gap = np.where(times < 30, 0.0, 3e6)
    paths = [Path(times + gap, rng.normal(size=60) + 2 * times) for _ in range(8)]
    assert compared(paths).white.deviation == pytest.approx(1.0, rel=0.15)


DRAWS = 30


@pytest.mark.nightly("compares sixty times: a minute of CPU")
def test_white_errors_are_seldom_called_correlated_and_correlated_ones_always():
    """At most 1 of 30 white ones, deviation within 15 % and time within 30 % in 28 of 30 correlated ones: 0 and 50 of 50."""
    wrong, near = 0, 0
    for seed in range(DRAWS):
        rng = np.random.default_rng(seed)
        wrong += compared(straight(rng, 0.0, rng.uniform(0.05, 0.5), 150, 16)).wins
        alike, deviation = rng.uniform(0.3, 0.9), rng.uniform(0.05, 0.5)
        found = compared(straight(rng, alike, deviation, 150, 16))
        size, lasts = found.correlated.deviation / deviation, found.correlated.tau / (-DT / np.log(alike))
        near += found.wins and abs(size - 1) < 0.15 and abs(lasts - 1) < 0.3
    assert wrong <= 1
    assert near >= 28


@pytest.mark.costly
def test_white_errors_of_a_target_that_circles_are_seldom_called_correlated():
    """By hundreds of nats, as their first halves tell it; what the second ones say of the first denies that."""
    told = []
    for seed in range(10):
        rng = np.random.default_rng(seed)
        t = np.sort(rng.uniform(0.0, 40.0, 150))
        t = t[(t < 15) | (t > 18)]
        x, y, z = 15 * np.cos(t / 6) - 30, 40 + 10 * np.sin(t / 6), 7 + 4 * np.sin(t / 9)
        told.append(compared([Path(t, np.arctan2(z, np.hypot(x, y)) + rng.normal(0.0, 0.002, len(t)))]))
    assert sum(one.wins for one in told) <= 1
    assert sum(one.gain > 50.0 and one.denied for one in told) >= 3
