"""Polar returns converted: bias, covariance, and where the radar stands."""

import numpy as np
import pytest

from vedette import Detections, Pose, Scan
from vedette_standard.preprocessors.debiased_conversion import DebiasedConversion
from vedette_standard.preprocessors.modified_unbiased_conversion import ModifiedUnbiasedConversion
from vedette_standard.preprocessors.naive_conversion import NaiveConversion
from vedette_standard.preprocessors.unbiased_conversion import UnbiasedConversion
from vedette_standard.sensors.range_bearing import RangeBearing

ALL = (NaiveConversion, DebiasedConversion, UnbiasedConversion, ModifiedUnbiasedConversion)
EXACT = (DebiasedConversion, UnbiasedConversion, ModifiedUnbiasedConversion)
COARSE = RangeBearing(1.5, np.deg2rad(1.0))
"""A bearing so poor that the conversions differ: at 20 km r sigma_bearing^2 / sigma_range is 4."""


def converted(kind, radar, z, pose=None, noise=None):
    detections = Detections(np.asarray(z, dtype=float), np.ones(np.shape(z)[:-1], dtype=bool), noise=noise)
    return kind({"radar": radar}).process({"radar": Scan(0.0, "radar", detections, pose)})


def polar_draws(radar, r, angle, count, rng):
    """Returns (count, 2) of a target at range and bearing."""
    return np.array([r, angle]) + rng.standard_normal((count, 2)) * [radar.sigma_range, radar.sigma_bearing]


# Conversions.
def test_the_naive_conversions_bias_matches_its_formula():
    """Along the line of sight r (exp(-s/2) - 1), within 4 standard errors: a right one fails with probability 6e-5."""
    r, angle = 20e3, np.deg2rad(37)
    z = converted(NaiveConversion, COARSE, polar_draws(COARSE, r, angle, 200_000, np.random.default_rng(1))).z
    along = z @ [np.cos(angle), np.sin(angle)] - r
    expected = r * (np.exp(-(COARSE.sigma_bearing**2) / 2) - 1)
    error = along.std() / np.sqrt(len(along))
    assert abs(along.mean() - expected) < 4 * error
    assert abs(expected) > 20 * error  # so that no bias at all would fail


@pytest.mark.parametrize("kind", [DebiasedConversion, UnbiasedConversion])
def test_unbiased_given_the_truth(kind):
    """Within 5 standard errors on each axis: 1e-6 for both axes and both kinds together."""
    truth = 20e3 * np.array([np.cos(0.6), np.sin(0.6)])
    error = converted(kind, COARSE, polar_draws(COARSE, 20e3, 0.6, 200_000, np.random.default_rng(2))).z - truth
    assert np.all(np.abs(error.mean(axis=0)) < 5 * error.std(axis=0) / np.sqrt(len(error)))


@pytest.mark.parametrize("kind", [UnbiasedConversion, ModifiedUnbiasedConversion])
def test_the_covariance_is_the_mean_square_given_the_return(kind):
    """Of z less the positions around one return, with their noise; by quadrature, so exactly."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(40)
    weights = weights / weights.sum()
    for r, angle in ((20e3, 0.0), (300.0, 2.5), (0.0, 1.0)):
        made = converted(kind, COARSE, [[r, angle]])
        ranges, bearings = r - COARSE.sigma_range * nodes[:, None], angle - COARSE.sigma_bearing * nodes
        both = np.stack([ranges * np.cos(bearings), ranges * np.sin(bearings)], axis=-1)
        apart = made.z[0] - both
        square = np.einsum("i,j,ija,ijb->ab", weights, weights, apart, apart)
        np.testing.assert_allclose(made.noise[0], square, rtol=1e-7, atol=1e-7 * np.trace(square))
        if kind is ModifiedUnbiasedConversion:  # the mean position itself
            np.testing.assert_allclose(np.einsum("i,j,ija->a", weights, weights, apart), 0, atol=1e-7)


@pytest.mark.parametrize("kind", EXACT)
def test_the_covariance_is_the_size_of_the_errors(kind):
    """Mean squared error over covariance of 20,000 returns of targets at many ranges: 2 within 5 standard errors and 2 %."""
    rng = np.random.default_rng(3)
    r, angle = rng.uniform(15e3, 25e3, 20_000), rng.uniform(-np.pi, np.pi, 20_000)
    z = np.stack([r, angle], axis=-1) + rng.standard_normal((20_000, 2)) * [COARSE.sigma_range, COARSE.sigma_bearing]
    made = converted(kind, COARSE, z)
    error = made.z - np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    size = np.einsum("ka,kab,kb->k", error, np.linalg.inv(made.noise), error)
    assert abs(size.mean() - 2) < 0.04 + 5 * size.std() / np.sqrt(len(size))
    naive = converted(NaiveConversion, COARSE, z)
    error = naive.z - np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)
    assert np.einsum("ka,kab,kb->k", error, np.linalg.inv(naive.noise), error).mean() > 8


def test_the_naive_covariance_is_that_of_the_paper():
    made = converted(NaiveConversion, COARSE, [[1000.0, 0.8]])
    J = np.array([[np.cos(0.8), -1000 * np.sin(0.8)], [np.sin(0.8), 1000 * np.cos(0.8)]])
    np.testing.assert_allclose(made.noise[0], J @ np.diag([1.5**2, np.deg2rad(1.0) ** 2]) @ J.T, rtol=1e-12)


@pytest.mark.parametrize("kind", ALL)
def test_all_agree_where_the_bearing_is_good(kind):
    radar = RangeBearing(1.5, 1e-5)
    made = converted(kind, radar, [[8000.0, 2.0]])
    np.testing.assert_allclose(made.z, 8000 * np.array([[np.cos(2.0), np.sin(2.0)]]), atol=1e-5)
    np.testing.assert_allclose(made.noise, converted(NaiveConversion, radar, [[8000.0, 2.0]]).noise, rtol=1e-6)


@pytest.mark.parametrize("kind", ALL)
def test_a_target_over_the_radar_has_a_proper_covariance(kind):
    for r in (0.0, 1e-9, 0.5, -0.5):  # noise may take a measured range below 0
        made = converted(kind, COARSE, [[r, 1.0]])
        assert np.linalg.eigvalsh(made.noise[0])[0] > 1e-5
        assert np.all(np.isfinite(made.z))


@pytest.mark.parametrize("kind", ALL)
def test_nothing_happens_where_the_bearing_wraps(kind):
    near = converted(kind, COARSE, [[5000.0, np.pi - 1e-9], [5000.0, -np.pi + 1e-9]])
    np.testing.assert_allclose(near.z[0], near.z[1], atol=1e-4)
    np.testing.assert_allclose(near.noise[0], near.noise[1], rtol=1e-6, atol=1e-3)


@pytest.mark.parametrize("kind", ALL)
def test_where_the_radar_stands_and_points(kind):
    pose = Pose(np.array([100.0, -50.0]), heading=0.3)
    z = np.array([[700.0, 0.9]])
    moved, plain = converted(kind, COARSE, z, pose), converted(kind, COARSE, z + [0.0, 0.3])
    np.testing.assert_allclose(moved.z, plain.z + pose.position, rtol=1e-12)
    np.testing.assert_allclose(moved.noise, plain.noise, rtol=1e-12)
    fixed = RangeBearing(1.5, np.deg2rad(1.0), x=100.0, y=-50.0, heading=0.3)
    np.testing.assert_array_equal(converted(kind, fixed, z).z, moved.z)


def test_a_returns_own_noise_is_taken_with_its_correlation():
    R = np.array([[4.0, 0.01], [0.01, 1e-4]])
    J = np.array([[np.cos(0.8), -1000 * np.sin(0.8)], [np.sin(0.8), 1000 * np.cos(0.8)]])
    made = converted(NaiveConversion, COARSE, [[1000.0, 0.8]], noise=R[None])
    np.testing.assert_allclose(made.noise[0], J @ R @ J.T, rtol=1e-9)


def test_a_conversion_takes_one_radar():
    with pytest.raises(ValueError, match="sensors: must hold one radar, got 2"):
        NaiveConversion({"a": COARSE, "b": COARSE})
