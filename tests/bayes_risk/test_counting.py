"""Probabilities of counts against draws."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vedette_bayes_risk.configs import DENSE, SIGMA, THRESHOLD
from vedette_bayes_risk.counting import Confirmation, number_of
from vedette_standard.sensors.cartesian_position import CartesianPosition

SEVEN = {f"s{i}": CartesianPosition(SIGMA, 1.0, DENSE) for i in range(1, 8)}
PROFILE = settings(max_examples=60)


# Probabilities.
@PROFILE
@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_how_many_happen(probabilities):
    """Against the sum over all outcomes."""
    expected = np.zeros(len(probabilities) + 1)
    for outcome in product([0, 1], repeat=len(probabilities)):
        expected[sum(outcome)] += np.prod([p if yes else 1 - p for p, yes in zip(probabilities, outcome, strict=True)])
    np.testing.assert_allclose(number_of(np.array(probabilities)), expected, atol=1e-14)


def drawn_counts(true_base, runs, rng):
    """How many sensors see a return at the base, the target's or a false one, six more in clutter: counted, not computed."""
    reach = 4 * THRESHOLD
    k = np.ones(runs, dtype=int)
    base = SIGMA * rng.standard_normal((runs, 2)) if true_base else np.zeros((runs, 2))
    for _ in range(6):
        number = rng.poisson(DENSE * (2 * reach) ** 2, runs)
        most = number.max()
        z = rng.uniform(-reach, reach, (runs, most, 2)) + base[:, None]
        near = np.any(
            (np.sum((z - base[:, None]) ** 2, axis=-1) <= THRESHOLD**2) & (np.arange(most) < number[:, None]), axis=1
        )
        if true_base:
            near |= np.sum((SIGMA * rng.standard_normal((runs, 2)) - base) ** 2, axis=-1) <= THRESHOLD**2
        k += near
    return np.bincount(k, minlength=8)[1:] / runs


@pytest.mark.costly
def test_the_count_given_a_target_and_given_clutter():
    """All 14 frequencies of 200,000 draws within 5 standard errors: 8e-6. Eq. 2, with independent distances, is far off."""
    found = Confirmation.of(SEVEN, "s1")
    rng = np.random.default_rng(1)
    for true_base, expected in ((True, found.given_target(THRESHOLD)), (False, found.given_clutter(THRESHOLD))):
        seen = drawn_counts(true_base, 200_000, rng)
        error = np.sqrt(np.maximum(expected * (1 - expected), 1e-5) / 200_000)
        assert np.all(np.abs(seen - expected) < 5 * error), (seen, expected)
        np.testing.assert_allclose(expected.sum(), 1.0)
        if true_base:
            p = 1 - found.miss(THRESHOLD)
            independent = number_of(1 - (1 - p) * (1 - found.false_alarm(THRESHOLD)))
            assert abs(seen[-1] - independent[-1]) > 20 * error[-1]


@PROFILE
@given(st.floats(1e-9, 1e-2), st.floats(1, 1e3), st.floats(0.1, 100), st.floats(0.05, 1))
def test_probabilities_are_probabilities(density, threshold, sigma, p_detect):
    """Whatever the clutter, where the printed P_FA = A_v/(lambda A_1) is above 1 for any area that a radar sees."""
    found = Confirmation.of({n: CartesianPosition(sigma, p_detect, density) for n in "abcd"}, "a")
    for p in (found.false_alarm(threshold), found.miss(threshold)):
        assert np.all((p >= 0) & (p <= 1))
    for p in (found.given_target(threshold), found.given_clutter(threshold)):
        assert np.all(p >= -1e-15)
        np.testing.assert_allclose(p.sum(), 1.0, rtol=1e-9)


def test_the_published_clutter():
    """.3e-6 /m^2 and 4 sigma: 6.8e-4, to first order lambda A_v; printed it is over 1 below 7,500 km^2, with a unit."""
    area = np.pi * THRESHOLD**2
    found = Confirmation.of({n: CartesianPosition(SIGMA, 1.0, 0.3e-6) for n in "ab"}, "a")
    np.testing.assert_allclose(found.false_alarm(THRESHOLD), 0.3e-6 * area, rtol=1e-3)
    np.testing.assert_allclose(found.miss(THRESHOLD), np.exp(-4))
    assert area / (0.3e-6 * 7.5e9) > 1


def test_the_fused_error_given_the_count():
    """By 200,000 draws of the paper's sensors, at 100 times its clutter: 5 standard errors where 300 draws or more count."""
    rng, runs = np.random.default_rng(2), 200_000
    base = SIGMA * rng.standard_normal((runs, 2))
    total, k = base.copy(), np.ones(runs, dtype=int)
    for _ in range(6):
        true = SIGMA * rng.standard_normal((runs, 2))
        far, turn = np.sqrt(rng.exponential(1 / (np.pi * DENSE), runs)), rng.uniform(0, 2 * np.pi, runs)
        false = base + far[:, None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)
        apart = np.hypot(*(true - base).T)
        near = np.minimum(apart, far) <= THRESHOLD
        total += np.where(near[:, None], np.where((far < apart)[:, None], false, true), 0.0)
        k += near
    square = np.sum((total / k[:, None]) ** 2, axis=-1) * k / (2 * SIGMA**2)
    expected = Confirmation.of(SEVEN, "s1").fused_error(THRESHOLD)
    for count in range(2, 8):
        some = square[k == count]
        if len(some) >= 300:
            assert abs(some.mean() - expected[count - 1]) < 5 * some.std() / np.sqrt(len(some)), count
    assert expected[1] > 5 > 1.1 > expected[6] > 0.9
