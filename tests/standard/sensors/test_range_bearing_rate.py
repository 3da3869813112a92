"""Range, bearing and range rate against the derivative of the range."""

import attrs
import numpy as np
import pytest

from vedette import Pose, kernels
from vedette_standard.sensors.range_bearing import RangeBearing
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

DOPPLER = RangeBearingRate(10.0, 0.01, 0.5, crossing_speed=8.0)
POSE = Pose(np.array([300.0, -200.0]), np.array([4.0, -3.0]), 0.7)


def rate_is_that_of_the_range(sensor, pose, x):
    """Differences in time of the distance between target and platform, both moving on."""
    h = 1e-3
    ends = [np.hypot(*(x[..., :2] + s * x[..., 2:] - pose.position - s * np.asarray(pose.velocity)).T) for s in (h, -h)]
    np.testing.assert_allclose(sensor.at(pose).measure(x)[..., 2], (ends[0] - ends[1]) / (2 * h), rtol=1e-6, atol=1e-6)


def test_range_rate_is_the_derivative_of_the_range():
    x = np.random.default_rng(1).normal(size=(6, 4)) * [1e3, 1e3, 20, 20]
    rate_is_that_of_the_range(DOPPLER, POSE, x)

    class Ashore:
        """A mutant that forgets that its platform moves."""

        def at(self, pose):
            return DOPPLER.at(attrs.evolve(pose, velocity=None))

    with pytest.raises(AssertionError):
        rate_is_that_of_the_range(Ashore(), POSE, x)


def test_doppler_over_the_radar_is_finite():
    x = np.array([[0.0, 0, 5, 3], [1e-9, 0, 5, 3], [0.5e-3, 0, 5, 3], [1.0, 0, 5, 3]])
    assert DOPPLER.measure(x)[0].tolist() == [0.0, 0.0, 0.0]
    assert np.all(np.isfinite(DOPPLER.jacobian(x)))
    slope = kernels.numerical_jacobian(DOPPLER.measure, x[3], DOPPLER.measurement.difference)
    np.testing.assert_allclose(DOPPLER.jacobian(x[3]), slope, atol=1e-5)


def test_a_doppler_return_starts_with_the_speed_along_the_line_of_sight():
    x = np.array([[800.0, 500.0, -10.0, 7.0], [-300.0, 1e3, 3.0, 4.0]])
    there = DOPPLER.at(POSE)
    found = there.invert(there.measure(x))
    los = x[:, :2] - POSE.position
    los /= np.hypot(*los.T)[:, None]
    across = np.stack([-los[:, 1], los[:, 0]], axis=-1)
    np.testing.assert_allclose(np.sum(found.mean[:, 2:] * los, axis=-1), np.sum(x[:, 2:] * los, axis=-1), rtol=1e-12)
    np.testing.assert_allclose(np.sum(found.mean[:, 2:] * across, axis=-1), 0, atol=1e-12)
    speed = found.cov[:, 2:, 2:]
    taken = across @ POSE.velocity * 0.01  # of the platform's own velocity, by the bearing's error
    np.testing.assert_allclose(np.einsum("bi,bij,bj->b", los, speed, los), 0.5**2 + taken**2, rtol=1e-9)
    np.testing.assert_allclose(np.einsum("bi,bij,bj->b", across, speed, across), 64.0, rtol=0.01)
    np.testing.assert_array_equal(
        found.cov[:, :2, :2], RangeBearing(10.0, 0.01).at(POSE).invert(there.measure(x)[:, :2]).cov
    )


def test_a_return_from_a_moving_platform_inverts_with_its_noise():
    """The bearing's error takes some of the platform's own velocity for the target's: H C H' = R holds with it alone."""
    rng = np.random.default_rng(4)
    for _ in range(20):
        pose = Pose(rng.normal(0, 100, 2), rng.normal(0, 30, 2), rng.uniform(-3, 3))
        sensor = RangeBearingRate(sigma_range=2.0, sigma_bearing=0.005, sigma_rate=0.05).at(pose)
        root = rng.normal(size=(3, 3)) * 0.3 + np.eye(3)
        scale = np.array([2.0, 0.005, 0.05])
        R = (root @ root.T) * scale[:, None] * scale
        found = sensor.invert(np.array([[rng.uniform(500, 2000), rng.uniform(-3, 3), rng.normal(0, 20)]]), R[None])
        H = sensor.jacobian(found.mean)[0]
        np.testing.assert_allclose(H @ found.cov[0] @ H.T / scale[:, None] / scale, R / scale[:, None] / scale, atol=0.02)
        spread = np.sqrt(np.diagonal(found.cov[0]))
        assert np.linalg.eigvalsh(found.cov[0] / spread[:, None] / spread)[0] > -1e-12
