"""The filter and smoother in lanes give what the joint Gaussian of all reports does."""

import numpy as np
import pytest

from vedette_tools.smoothing import linear
from vedette_tools.smoothing.modes import Stance, bank
from vedette_tools.smoothing.paths import Paths, windows

VAGUE = 1e5
"""m^2: a prior that leaves the dense solution its digits."""


def paths_of(rng, lengths, paced=True):
    """Return pieces of some lengths at uneven times, some rows without a report."""
    n = sum(lengths)
    starts = np.concatenate([[0], np.cumsum(lengths)])
    told = rng.random(n) < 0.8
    told[starts[:-1]] = True
    velocities = rng.normal(0, 5, (n, 2))
    velocities[rng.random(n) < (0.4 if paced else 1.0)] = np.nan
    return Paths(starts, np.cumsum(rng.exponential(4.0, n)), rng.normal(0, 100, (n, 2)), velocities, told)


def joint(paths, accel, sigma, sigma_velocity, speed):
    """Return means (n, 2, 2) and covariances (n, 2, 2) of one piece along an axis, by conditioning the joint Gaussian."""
    n, dt = len(paths), paths.waits
    F = [np.array([[1.0, h], [0.0, 1.0]]) for h in dt]
    across = np.zeros((n, 2, n, 2))
    P = np.diag([VAGUE, speed[0] ** 2])
    for i in range(n):
        if i:
            h, q = dt[i], accel[i] ** 2
            P = F[i] @ P @ F[i].T + q * np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]])
        across[i, :, i] = P
        for j in range(i + 1, n):
            across[j, :, i] = F[j] @ across[j - 1, :, i]
            across[i, :, j] = across[j, :, i].T
    prior = across.reshape(2 * n, 2 * n)
    paced = paths.told & np.isfinite(paths.velocities).all(axis=1)
    seen = np.concatenate([2 * np.flatnonzero(paths.told), 2 * np.flatnonzero(paced) + 1])
    noise = np.concatenate([sigma[paths.told] ** 2, sigma_velocity[paced] ** 2])
    first = paths.spots[0]
    z = np.concatenate([paths.spots[paths.told] - first, paths.velocities[paced]])
    gain = np.linalg.solve(prior[np.ix_(seen, seen)] + np.diag(noise), prior[seen]).T
    mean, cov = (gain @ z).reshape(n, 2, 2), prior - gain @ prior[seen]
    mean[:, 0] += first
    every = np.arange(n)
    return mean, cov.reshape(n, 2, n, 2)[every, :, every]


@pytest.mark.parametrize("paced", [True, False])
def test_every_piece_is_as_the_joint_gaussian_says(paced, monkeypatch):
    monkeypatch.setattr(linear, "VAGUE", VAGUE)
    rng = np.random.default_rng(3)
    lengths = [7, 1, 12, 2]
    paths = paths_of(rng, lengths, paced)
    n = len(paths)
    accel, sigma, sigma_velocity = rng.uniform(0.1, 3, n), rng.uniform(1, 9, n), rng.uniform(0.2, 2, n)
    speed = np.full(n, 20.0)
    found = linear.smoothed(paths, accel, sigma, sigma_velocity, speed)
    for first, last in zip(paths.starts[:-1], paths.starts[1:], strict=True):
        rows = np.arange(first, last)
        one = paths.only(rows, np.array([0, len(rows)]))
        mean, cov = joint(one, accel[rows], sigma[rows], sigma_velocity[rows], speed[rows])
        np.testing.assert_allclose(found.spots[rows], mean[:, 0], rtol=1e-8, atol=1e-7)
        np.testing.assert_allclose(found.velocities[rows], mean[:, 1], rtol=1e-8, atol=1e-7)
        np.testing.assert_allclose(found.spot_variances[rows], cov[:, 0, 0], rtol=1e-7)
        np.testing.assert_allclose(found.velocity_variances[rows], cov[:, 1, 1], rtol=1e-7)


def test_a_bank_of_one_mode_scores_as_the_joint_gaussian_does():
    rng = np.random.default_rng(4)
    paths = paths_of(rng, [9], paced=False)
    dt, sigma, accel, speed = paths.waits, 6.0, 0.7, 20.0
    steps = rng.normal(0, 1, (9, 2)) * sigma
    paths = Paths(paths.starts, paths.times, steps, paths.velocities, np.ones(9, dtype=bool))
    stance = Stance(np.ones((1, 1)), np.full(1, 0.1), np.array([sigma]), np.ones(1))
    one = bank(paths, np.array([accel]), stance, np.full(9, speed))
    P, x, total = np.diag([sigma**2, speed**2]), np.stack([steps[0], np.zeros(2)]), 0.0
    for k in range(1, 9):
        h = dt[k]
        F = np.array([[1, h], [0, 1]])
        P, x = F @ P @ F.T + accel**2 * np.array([[h**3 / 3, h**2 / 2], [h**2 / 2, h]]), F @ x
        S, off = P[0, 0] + sigma**2, steps[k] - x[0]
        total += -0.5 * off @ off / S - np.log(2 * np.pi * S)
        gain = P[:, :1] / S
        x, P = x + gain * off, P - gain @ gain.T * S
    assert one.loglik.sum() == pytest.approx(total, abs=1e-6)
    np.testing.assert_allclose(one.prob, 1.0)


def test_windows_of_a_long_piece_change_nothing_that_counts():
    rng = np.random.default_rng(5)
    paths = paths_of(rng, [900, 30])
    n = len(paths)
    given = np.full(n, 0.3), np.full(n, 5.0), np.full(n, 1.0), np.full(n, 20.0)
    whole = linear.smoothed(paths, *given)
    cut, rows, own, pieces = windows(paths, 200, 50)
    assert pieces.tolist() == [0, 0, 0, 0, 0, 1]
    assert len(cut.lengths) == 6
    assert np.array_equal(np.sort(rows[own]), np.arange(n))
    apart = linear.smoothed(cut, *(each[rows] for each in given))
    off = np.linalg.norm(apart.spots[own] - whole.spots[rows[own]], axis=1)
    assert np.max(off / np.sqrt(whole.spot_variances[rows[own]])) < 0.01
