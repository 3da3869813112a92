"""Noise by likelihood, against a Kalman filter written down plainly, and chains of returns."""

import tracemalloc

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from support.foreign_files import paths
from vedette_tools.drafting.chains import CANDIDATES, COAST, LEAST, START, Chain, chains, spacing
from vedette_tools.drafting.noise import Windows, estimated, loglik


def seen(seed, sigma=4.0, accel=0.3, count=6, scans=120, clutter=0.0, p_detect=1.0):
    """Times, the positions of the returns of each scan, and the truth (targets, scans, 4)."""
    rng, times = np.random.default_rng(seed), 1.0 * np.arange(scans)
    states = paths(rng, count, times, accel, 800, 8)
    spots = []
    for k in range(scans):
        own = states[rng.random(count) < p_detect, k, :2]
        own = own + rng.normal(0, sigma, own.shape)
        spots.append(np.concatenate([own, rng.uniform(-2000, 2000, (rng.poisson(clutter), 2))]))
    return times, spots, states


def windows_of(found):
    return Windows.of(found, [np.tile(np.eye(2), (len(chain.times), 1, 1)) for chain in found])


def test_spacing_is_half_the_median_distance_to_the_nearest_and_takes_no_memory_for_all_pairs():
    """A scan of 5,000 returns took 400 MB, and half a second."""
    rng = np.random.default_rng(0)
    spots = [rng.normal(0, 100, (count, 2)) for count in (40, 1, 0, 25)]
    apart = [np.linalg.norm(each[:, None] - each, axis=-1) + np.diag([np.inf] * len(each)) for each in (spots[0], spots[3])]
    nearest = np.concatenate([each.min(axis=1) for each in apart])
    assert spacing(spots) == pytest.approx(0.5 * np.median(nearest), rel=1e-12)
    assert np.isinf(spacing([np.zeros((1, 2))]))
    tracemalloc.start()
    spacing([rng.normal(0, 100, (2000, 2))])
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2000**2, "bytes"


def test_chains_are_the_targets_in_clutter():
    times, spots, states = seen(1, clutter=3.0, p_detect=0.9)
    found = chains(times, spots, min(spacing(spots), 25.0))
    assert sum(len(chain.times) for chain in found) > 0.8 * 0.9 * 6 * 120
    for chain in found:
        apart = np.linalg.norm(states[:, chain.scans, :2] - chain.spots, axis=-1)
        assert np.mean(apart.min(axis=0) < 20) > 0.97


def test_no_return_is_in_two_chains_and_scans_increase():
    times, spots, _ = seen(2, clutter=5.0, p_detect=0.7)
    members = [(i, j) for chain in chains(times, spots, 40.0) for i, j in zip(chain.scans, chain.returns, strict=True)]
    assert len(set(members)) == len(members)
    for chain in chains(times, spots, 40.0):
        assert np.all(np.diff(chain.scans) > 0)


def test_a_chain_has_one_return_at_a_time_where_rows_are_scans():
    """It took both of a time as of one target, whose speed was then infinite."""
    times, spots, _ = seen(3, count=2)
    found = chains(np.repeat(times, 2), list(np.concatenate(spots)[:, None]), np.inf)
    assert max(len(chain.times) for chain in found) > 100
    assert all(np.all(np.diff(chain.times) > 0) for chain in found)


def plainly(times, spots, width):
    """The chains, chain by chain and place by place: a list of (scan, return) each, as `chains` finds them."""
    growing, done, before = [], [], []
    for i, places in enumerate(spots):
        free, kept = set(range(len(places))), []
        for members, spot, velocity, time in sorted(growing, key=lambda chain: -len(chain[0])):
            expected, dt = spot + velocity * (times[i] - time), times[i] - time
            apart, j = min(((np.hypot(*(places[j] - expected)), j) for j in free), default=(np.inf, -1))
            gain = max(0.3, 2 / (len(members) + 1))
            if hit := apart <= width:
                free.remove(j)
                members, off, time = [*members, (i, j)], places[j] - expected, times[i]
                spot, velocity = expected + max(0.5, gain) * off, velocity + gain * off / dt
            goes_on = i - members[-1][0] <= COAST and (hit or len(members) > 2)
            (kept if goes_on else done).append((members, spot, velocity, time))
        for j in sorted(free):
            near = sorted((np.hypot(*(spots[i - 1][k] - places[j])), k) for k in before)[:CANDIDATES]
            for k in [k for apart, k in near if apart <= START * width]:
                velocity = (places[j] - spots[i - 1][k]) / (times[i] - times[i - 1])
                kept += [([(i - 1, k), (i, j)], places[j], velocity, times[i])]
        growing, before = kept, sorted(free)
    used, found = set(), []
    for members, *_ in sorted([*done, *growing], key=lambda chain: -len(chain[0])):
        own = [member for member in members if member not in used]
        if len(own) >= max(LEAST, 0.8 * len(members)) and len(own) >= 0.5 * (own[-1][0] - own[0][0] + 1):
            used.update(own)
            found.append(own)
    return found


@pytest.mark.parametrize(("seed", "width"), [(1, 25.0), (2, 120.0), (3, 400.0)])
def test_chains_are_those_that_a_loop_over_chains_and_places_finds(seed, width):
    times, spots, _ = seen(seed, clutter=12.0, p_detect=0.8, scans=25)
    crowd = np.tile(spots[4][:3], (6, 1)) + np.arange(18)[:, None] / 7  # more than are looked up at once
    spots[4] = np.concatenate([spots[4], crowd])
    found = [list(zip(chain.scans, chain.returns, strict=True)) for chain in chains(times, spots, width)]
    assert found
    assert found == plainly(times, spots, width)


def test_of_many_objects_a_scan_each_is_held_against_a_few(monkeypatch):
    """A draft of 5,000 objects a scan did not end, as each chain was held against each return."""
    rng, norm, numbers = np.random.default_rng(0), np.linalg.norm, []
    start, velocity = rng.uniform(0, 1e4, (400, 2)), rng.normal(0, 10, (400, 2))
    monkeypatch.setattr(np.linalg, "norm", lambda apart, **how: [numbers.append(np.size(apart)), norm(apart, **how)][1])
    spots = [start + velocity * k for k in range(8)]
    assert len(chains(np.arange(8.0), spots, 30.0)) == 400
    assert sum(numbers) < 50 * 8 * 400


@pytest.mark.parametrize("spots", [[], [np.zeros((0, 2))] * 5, [np.zeros((1, 2))] * 3])
def test_too_little_gives_no_chain(spots):
    assert chains(np.arange(float(len(spots))), spots, 10.0) == []


def test_the_likelihood_is_that_of_the_joint_gaussian():
    """All positions after the first, given it, are jointly Gaussian: their density by one big covariance."""
    times, spots, _ = seen(3, count=1, scans=7)
    found = chains(times, spots, np.inf)
    sigma, accel, speed = 4.0, 0.3, 8.0
    z = found[0].spots[1:, 0] - found[0].spots[0, 0], found[0].spots[1:, 1] - found[0].spots[0, 1]
    t = times[1:]
    early, late = np.minimum.outer(t, t), np.maximum.outer(t, t)
    cov = sigma**2 * (1 + np.eye(6)) + (2 * speed) ** 2 * np.outer(t, t)
    cov += accel**2 * (early**2 * late / 2 - early**3 / 6)
    wanted = sum(multivariate_normal(np.zeros(6), cov).logpdf(own) for own in z)
    assert loglik(windows_of(found), np.array([sigma, sigma]), accel, speed) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.costly
def test_the_noise_is_found_within_its_error():
    """Six targets over 120 scans: the errors are some 3 % and 20 %, those of the mean of two draws less."""
    found = []
    for seed in range(2):
        times, spots, _ = seen(10 + seed)
        noise = estimated(windows_of(chains(times, spots, 30.0)), (10.0, 1.0), 8.0, lambda own: np.repeat(own, 2))
        found.append((noise.sensor[0], noise.accel))
    sigma, accel = np.exp(np.mean(np.log(found), axis=0))
    assert sigma == pytest.approx(4.0, rel=0.06)
    assert accel == pytest.approx(0.3, rel=0.3)


def test_errors_far_larger_along_a_line_of_sight_than_across_leave_a_likelihood():
    """Rounding made determinants negative, with a warning."""
    times, spots, _ = seen(3, count=1, scans=40)
    chain = max(chains(times, spots, 60.0), key=lambda one: len(one.times))
    angles = np.linspace(0.1, 6.0, len(chain.times))
    lines = np.moveaxis(np.array([[np.cos(angles), -np.sin(angles)], [np.sin(angles), np.cos(angles)]]), -1, 0)
    with np.errstate(invalid="raise", divide="raise"):
        assert np.isfinite(loglik(Windows.of([chain], [lines]), np.array([1e6, 1e-7]), 1e-9, 1e-3))


def test_errors_that_differ_by_far_leave_covariances_definite():
    """Where nothing fitted, numpy's warnings reached the terminal: errors of 370 km along the line, 5e-7 rad across it."""
    looks = np.arange(38)
    for seed in range(6):
        rng = np.random.default_rng(seed)
        bearing, r = rng.uniform(0, 6.28), rng.uniform(1e3, 2e5, (38, 1))
        spots = r * [np.cos(bearing), np.sin(bearing)]
        chain = Chain(looks, 0 * looks, np.cumsum(rng.exponential(4.0, 38)), spots)
        windows = Windows.of([chain], [np.stack([spots / r, spots[:, ::-1] * [-1, 1]], axis=-1)])
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            assert np.isfinite(loglik(windows, np.array([3.7e5, 5e-7]), 3.2, 1e5))
