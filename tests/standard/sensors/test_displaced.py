"""A sensor displaced by known numbers is the biased one at these."""

import numpy as np
import pytest

from vedette import Pose
from vedette_standard.sensors.biased import Biased
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.displaced import Displaced
from vedette_standard.sensors.range_bearing import RangeBearing

RADAR = RangeBearing(sigma_range=5.0, sigma_bearing=0.01)
X = np.random.default_rng(0).normal(size=(5, 4)) * [400.0, 400.0, 8.0, 8.0] + [1000.0, 0.0, 0.0, 0.0]


def test_it_measures_as_the_biased_sensor_at_its_numbers():
    known = Displaced(RADAR, {"bearing": 0.02, "range": 3.0}, {"x": 5.0}, 0.5)
    free = Biased(RADAR, {"bearing": "b", "range": "r"}, {"x": "d"}, "l")
    whole = np.concatenate([X, np.broadcast_to([0.02, 3.0, 5.0, 0.5], (5, 4))], axis=-1)
    assert known.observes.names == free.observes.names[:4]
    np.testing.assert_array_equal(known.measure(X), free.measure(whole))
    np.testing.assert_array_equal(known.jacobian(X), free.jacobian(whole)[..., :4])


def test_a_return_is_inverted_without_its_errors():
    known = Displaced(RADAR, {"bearing": 0.02, "range": 3.0}, {"x": 5.0})
    back = known.invert(known.measure(X[:, :2]))
    np.testing.assert_allclose(back.mean, X[:, :2], atol=1e-4 * 2000)
    assert np.max(np.abs(RADAR.invert(known.measure(X[:, :2])).mean - X[:, :2])) > 10.0


def test_on_a_platform_a_late_return_is_of_where_both_were():
    known, late = Displaced(RADAR, {}, {}, 2.0), X - 2.0 * np.concatenate([X[:, 2:], np.zeros((5, 2))], axis=-1)
    pose, before = Pose(np.array([10.0, 20.0]), np.array([3.0, -4.0]), 0.3), Pose(np.array([4.0, 28.0]), None, 0.3)
    np.testing.assert_allclose(known.at(pose).measure(X), RADAR.at(before).measure(late[:, :2]))
    free = Biased(RADAR, lag="l").at(pose)
    whole = np.concatenate([X, np.full((5, 1), 2.0)], axis=-1)
    np.testing.assert_allclose(free.measure(whole), RADAR.at(before).measure(late[:, :2]))
    steps = [(free.measure(whole + step) - free.measure(whole - step)) / 2e-4 for step in 1e-4 * np.eye(5)]
    np.testing.assert_allclose(free.jacobian(whole), np.stack(steps, axis=-1), rtol=1e-5, atol=1e-6)


def test_a_late_position_is_one_that_was_in_reach_then():
    """Of a sensor whose positions are not relative to its platform: what it sees depends on where that stood."""
    lidar = CartesianPosition(1.0, max_range=100.0, detection_probability=0.9)
    then = lidar.at(Pose(np.array([-50.0, 100.0])))
    now = Displaced(lidar, {}, {}, 2.0).at(Pose(np.array([10.0, 20.0]), np.array([30.0, -40.0])))
    x = np.array([[-120.0, 130.0, 5.0, 0.0], [60.0, 20.0, 5.0, 0.0]])
    np.testing.assert_array_equal(now.detects(x), [0.9, 0.0])
    np.testing.assert_array_equal(now.detects(x), then.detects(x[:, :2] - 2.0 * x[:, 2:]))


def test_an_offset_along_x_and_y_takes_no_platform():
    with pytest.raises(NotImplementedError):
        Displaced(RADAR, {}, {"x": 5.0}).at(Pose(np.zeros(2)))


def test_a_late_return_starts_no_track():
    with pytest.raises(NotImplementedError):
        Displaced(RADAR, {}, {}, 0.5).invert(np.array([1000.0, 0.1]))
