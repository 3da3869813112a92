"""Curved paths against their differential equation."""

import numpy as np
import pytest

from support.integration import integrated
from vedette_standard.motion.constant_acceleration import ConstantAcceleration
from vedette_standard.motion.curvilinear import Curvilinear


# Curved paths.
def along_and_across(x):
    course = x[2:4] / np.hypot(*x[2:4])
    left = np.array([-course[1], course[0]])
    return np.concatenate([x[2:4], x[4] * course + x[5] * left, np.zeros(2)])


PATHS = [(0, 0), (1, 0), (-0.5, 0), (0, 1), (0.5, -2), (-1, 1), (1e-12, 1e-12), (1e-5, 3)]
CURVED = Curvilinear(0.1, 0.2)


@pytest.mark.parametrize(("tangential", "normal"), PATHS)
def test_a_curved_path_is_that_of_its_differential_equation(tangential, normal):
    x = np.array([10.0, -20.0, 12.0, -5.0, tangential, normal])
    expected = integrated(along_and_across, x, 6.0)
    np.testing.assert_allclose(CURVED.move(x, 6.0), expected, rtol=1e-6, atol=1e-4)
    with pytest.raises(AssertionError):
        np.testing.assert_allclose(CURVED.move(x + np.eye(6)[2] * 1e-2, 6.0), expected, rtol=1e-6, atol=1e-4)


def test_a_normal_acceleration_is_a_circle():
    x = np.array([0.0, 0, 10, 0, 0, 2.0])
    around = CURVED.move(x, 2 * np.pi * 10 / 2)
    np.testing.assert_allclose(around, x, atol=1e-3)
    assert CURVED.move(x, np.pi * 10 / 2)[1] == pytest.approx(2 * 10**2 / 2, rel=1e-5)


def test_what_brakes_stands_where_it_stopped():
    x = np.array([0.0, 0, 10, 0, -2.0, 0])
    later = CURVED.move(np.stack([x, x]), 5.0)[0], CURVED.move(x, 60.0)
    assert later[1][0] == pytest.approx(10**2 / 2 / 2, rel=1e-4)
    assert np.hypot(*later[1][2:4]) < 0.011
    assert np.all(np.isfinite(CURVED.move(np.array([0, 0, 0, 0, 5.0, 5.0]), 60.0)))


def test_noise_of_a_curved_path_follows_its_course():
    """Along the path it is that of white jerk with the one deviation, across it with the other."""
    course = 0.7
    along, across = np.array([np.cos(course), np.sin(course)]), np.array([-np.sin(course), np.cos(course)])
    Q = CURVED.noise(np.array([0, 0, *(9 * along), 0.3, 0.4]), 2.0)
    for direction, sigma, own in ((along, 0.1, 4), (across, 0.2, 5)):
        to_axis = np.zeros((3, 6))
        to_axis[0, :2] = to_axis[1, 2:4] = direction
        to_axis[2, own] = 1.0
        expected = ConstantAcceleration(sigma, axes=("x",)).covariance(2.0)
        np.testing.assert_allclose(to_axis @ Q @ to_axis.T, expected, rtol=1e-12)
