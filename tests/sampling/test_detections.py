"""Drawn returns and clutter against what the sensor states.

Every statistical test accepts at a false alarm rate of ALPHA, whatever the seed.
"""

import numpy as np
import pytest
from attrs import evolve
from scipy import stats

from support.scenes import REGION, Polar
from support.statistics import ALPHA, dispersion_p, moments_match
from vedette import sampling
from vedette.sampling import shuffled
from vedette_standard.sensors.cartesian_position import CartesianPosition


def test_returns_are_noisy_as_stated_and_wrap():
    sensor = Polar()
    x = np.broadcast_to([-300.0, 0.5], (4000, 1, 2))
    seen = sampling.draw_detections(sensor, x, np.random.default_rng(4))
    z = seen.z[seen.valid]
    assert np.all((z[:, 1] >= -np.pi) & (z[:, 1] < np.pi))
    assert np.any(z[:, 1] < 0)
    assert np.any(z[:, 1] > 0)
    error = sensor.measurement.difference(z, sensor.measure(x[:1, 0]))
    assert moments_match(error, np.zeros(2), np.diag([25.0, 0.05**2]))


def test_objects_are_detected_as_often_as_the_sensor_says():
    x = np.broadcast_to([[100.0, 0.0], [0.0, 2000.0], [-50.0, 50.0]], (2000, 3, 2))
    _, seen = sampling.returns(Polar(), x, np.random.default_rng(4).random((2000, 3)), np.zeros((2000, 3, 2)))
    hits = seen.sum(axis=0)
    assert hits[1] == 0
    for count in (hits[0], hits[2]):
        assert stats.binomtest(int(count), 2000, 0.9).pvalue > ALPHA
    sure = sampling.draw_detections(
        evolve(Polar(), p_detect=1.0), x, np.random.default_rng(0), alive=np.array([True, True, False])
    )
    assert np.all(sure.valid.sum(axis=-1) == 1)
    assert np.all(sure.z[..., 0] > 75)


def test_clutter_has_the_density_that_the_sensor_states():
    sensor, runs = Polar(density=3e-6), 1000
    z, valid = sampling.draw_clutter(sensor, REGION, np.random.default_rng(6), (runs,))
    expected = 3e-6 * np.pi * (1000.0**2 - 100.0**2)
    counts = valid.sum(axis=-1)
    assert dispersion_p(counts, expected) > ALPHA
    assert dispersion_p(counts, 1.1 * expected) < ALPHA
    distance, bearing = z[valid].T
    assert stats.kstest(distance, lambda r: (r**2 - 100.0**2) / (1000.0**2 - 100.0**2)).pvalue > ALPHA
    assert stats.kstest(distance, lambda r: (r - 100) / 900).pvalue < ALPHA
    assert stats.kstest(bearing, stats.uniform(-np.pi, 2 * np.pi).cdf).pvalue > ALPHA


def test_uniform_clutter_fills_its_box_and_nothing_else():
    sensor = CartesianPosition(sigma=1.0, clutter_density=1e-4)
    box = {"y": sampling.Bounds(0, 500), "x": sampling.Bounds(-100, 300)}
    z, valid = sampling.draw_clutter(sensor, box, np.random.default_rng(6), (1000,))
    assert dispersion_p(valid.sum(axis=-1), 20.0) > ALPHA
    assert stats.kstest(z[valid][:, 0], stats.uniform(-100, 400).cdf).pvalue > ALPHA
    assert stats.kstest(z[valid][:, 1], stats.uniform(0, 500).cdf).pvalue > ALPHA
    quiet = sampling.draw_clutter(CartesianPosition(sigma=1.0), box, np.random.default_rng(6))[1]
    assert quiet.shape == (0,)


def test_a_sector_over_the_seam_stays_a_sector():
    sector = {"range": sampling.Bounds(100, 1000), "bearing": sampling.Bounds(3.0, 3.5)}
    z, valid = sampling.draw_clutter(Polar(density=1e-4), sector, np.random.default_rng(6), (20,))
    bearing = z[valid][:, 1]
    assert np.all(np.abs(bearing) <= np.pi)
    assert np.all((bearing >= 3.0) | (bearing <= 3.5 - 2 * np.pi))
    assert np.any(bearing < 0)


def test_returns_come_in_random_order_and_valid_ones_first():
    z = np.broadcast_to(np.arange(5.0, 9.0)[:, None], (6000, 4, 1))
    valid = np.broadcast_to([True, False, True, True], (6000, 4))
    seen = shuffled(z, valid, np.random.default_rng(9))
    assert seen.z.shape == (6000, 3, 1)
    assert np.all(seen.valid)
    orders, counts = np.unique(seen.z[..., 0], axis=0, return_counts=True)
    assert len(orders) == 6
    assert np.sum((counts - 1000.0) ** 2 / 1000) < stats.chi2.isf(ALPHA, 5)
    ragged = shuffled(z[:2], np.array([[False, True, False, False], [False, True, False, True]]), np.random.default_rng(9))
    assert ragged.valid.tolist() == [[True, False], [True, True]]
    assert ragged.z[0].tolist() == [[6.0], [0.0]]
    assert sorted(ragged.z[1, :, 0]) == [6.0, 8.0]


@pytest.mark.costly
def test_a_batch_of_scans_is_like_scans_one_by_one():
    sensor = Polar(density=2e-6)
    x = np.array([[200.0, 0.0], [0.0, -700.0]])
    batch = sampling.draw_detections(sensor, np.broadcast_to(x, (800, 2, 2)), np.random.default_rng(1), REGION)
    rng = np.random.default_rng(2)
    singles = [sampling.draw_detections(sensor, x, rng, REGION) for _ in range(800)]
    assert all(np.all(one.valid) for one in singles)
    assert np.all(np.diff(batch.valid.astype(int), axis=-1) <= 0)
    alone = np.concatenate([one.z for one in singles])
    for axis in range(2):
        assert stats.ks_2samp(batch.z[batch.valid][:, axis], alone[:, axis]).pvalue > ALPHA
    counts = batch.valid.sum(axis=-1), np.array([len(one.z) for one in singles])
    pooled = np.sqrt((np.var(counts[0]) + np.var(counts[1])) / 800)
    assert abs(counts[0].mean() - counts[1].mean()) < stats.norm.isf(ALPHA / 2) * pooled
