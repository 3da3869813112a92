"""Moments and walks of accelerations."""

import numpy as np

from vedette_target_oriented import accelerations


# Section 4.1.
def test_turning_the_axes_keeps_the_mean_square_to_the_last_digits():
    for part in accelerations.study(2, np.random.default_rng(1)).values():
        if part.own is not part.fixed:
            square = [np.sum(np.var(pair, axis=1) + np.mean(pair, axis=1) ** 2, axis=-1) for pair in (part.fixed, part.own)]
            np.testing.assert_allclose(*square, rtol=1e-12)


def test_correlation_is_that_of_numpy():
    pair = np.cumsum(np.random.default_rng(2).standard_normal((1, accelerations.SECONDS, 2)), axis=1)
    rho = accelerations.correlation(pair)[0]
    a, b = (pair[0] - pair[0].mean(axis=0)).T
    full = np.correlate(a, b, "full") / np.sqrt(np.sum(a**2) * np.sum(b**2))
    middle = accelerations.SECONDS - 1
    np.testing.assert_allclose(rho, full[middle - 100 : middle + 101], atol=1e-9)


def test_kurtosis_of_what_is_known():
    """A uniform's is 1.8, a two-valued one's 1."""
    np.testing.assert_allclose(accelerations.kurtosis(np.arange(10_001.0)[None]), 1.8, rtol=1e-6)
    np.testing.assert_allclose(accelerations.kurtosis(np.array([[1.0, -1] * 50])), 1.0)


def test_walks_start_anew_and_rest_each_at_times_of_its_own():
    walk = accelerations.pieces(8, np.random.default_rng(3))
    resting = walk == 0
    begin = ~resting[:, 1:] & resting[:, :-1]
    after = walk[:, 1:][begin]  # the first step of each walk is one draw: standard deviation 1, whatever went before
    assert 0.47 < resting.mean() < 0.53  # half of the time: +- .004
    assert 0.9 < after.std() < 1.1  # 8000 draws: +- .008
    both = resting - resting.mean(axis=1, keepdims=True)
    together = np.sum(both[..., 0] * both[..., 1], axis=1) / np.sqrt(np.prod(np.sum(both**2, axis=1), axis=-1))
    assert abs(together.mean()) < 0.06  # 1 if they shared their times; +- .012


def test_turning_the_axes_makes_the_forward_acceleration_less_peaked():
    """8.13 +- .07 against 6.9 +- .07 over 100 trajectories; with times in common the two are equal by construction."""
    found = accelerations.measured(accelerations.study(30, np.random.default_rng(4))["scenario 1"])
    gap = found.kurtosis[:, 0] - found.kurtosis[:, 2]
    assert gap.mean() > 4 * gap.std(ddof=1) / np.sqrt(30)
