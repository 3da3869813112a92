"""Turns in space against their differential equation."""

import numpy as np
import pytest

from support.integration import integrated
from vedette import kernels
from vedette_standard.motion.coordinated_turn import CoordinatedTurn
from vedette_standard.motion.coordinated_turn_3d import CoordinatedTurn3d


def turning(x):
    return np.concatenate([x[3:6], np.cross(x[6:], x[3:6]), np.zeros(3)])


def turns_about_its_vector(model, scale):
    rng = np.random.default_rng(4)
    for _ in range(5):
        x = rng.normal(size=9) * [100, 100, 100, 10, 10, 10, scale, scale, scale]
        np.testing.assert_allclose(model.move(x, 2.0), integrated(turning, x, 2.0), rtol=1e-9, atol=1e-9)
        slope = kernels.numerical_jacobian(lambda y: model.move(y, 2.0), x, model.state.difference)
        np.testing.assert_allclose(model.jacobian(x, 2.0), slope, rtol=0, atol=1e-8 * np.max(np.abs(slope)))


SPACE = CoordinatedTurn3d(0.5, 0.01)


@pytest.mark.parametrize("scale", [0.0, 1e-7, 0.01, 0.2, 0.29, 1.0])
def test_a_turn_in_space_is_that_of_its_differential_equation(scale):
    turns_about_its_vector(SPACE, scale)


class Mutant:
    """The turn in space with one share wrong."""

    state = SPACE.state

    def __init__(self, entry):
        self.entry = entry

    def move(self, x, dt):
        moved = SPACE.move(x, dt)
        moved[..., self.entry] += 1e-6 * x[..., 3]
        return moved

    def jacobian(self, x, dt):
        F = SPACE.jacobian(x, dt).copy()
        F[..., 0, 7] *= 1 + 1e-3 * (self.entry is None)
        return F


def test_the_law_of_turns_in_space_bites():
    for entry in (0, 4):
        with pytest.raises(AssertionError):
            turns_about_its_vector(Mutant(entry), 0.2)


@pytest.mark.parametrize("rate", [0.0, 0.03, -0.7])
def test_a_turn_about_the_vertical_is_the_turn_in_the_plane(rate):
    x = np.array([10.0, 20, 30, 5, -3, 2, 0, 0, rate])
    plane = CoordinatedTurn(0.5, 0.01)
    flat = [0, 1, 3, 4, 8]
    np.testing.assert_allclose(SPACE.move(x, 3.0)[flat], plane.move(x[flat], 3.0), rtol=1e-13)
    np.testing.assert_allclose(
        SPACE.jacobian(x, 3.0)[np.ix_(flat, flat)], plane.jacobian(x[flat], 3.0), rtol=1e-9, atol=1e-12
    )
    np.testing.assert_array_equal(SPACE.noise(x, 3.0)[np.ix_(flat, flat)], plane.noise(x[flat], 3.0))
    assert SPACE.move(x, 3.0)[2] == pytest.approx(36.0)
