"""A textbook's range and bearing, whose conversion is singular over the sensor itself: right, and its mutants are caught."""

import numpy as np
import pytest
from attrs import frozen

import vedette
from vedette.testing import Profile, examine, laws_of
from vedette.testing.laws.sensor_cases import regular
from vedette.testing.strategies import components

FAST = Profile.named("fast", 0)


@frozen
class Sonar(vedette.Sensor):
    """z = (r, b) of a target seen from the origin, inverted to first order: J R J', which is singular where r = 0."""

    kind = "test_sonar"
    observes = vedette.Space.of(x="m", y="m")
    measurement = vedette.Space.of(range="m", bearing="rad mod 2pi")
    sigma_range: float = vedette.fields.quantity("m", "of the range", above=0)
    sigma_bearing: float = vedette.fields.quantity("rad", "of the bearing", above=0, at_most=0.2)

    def measure(self, x):
        return np.stack([np.hypot(x[..., 0], x[..., 1]), np.arctan2(x[..., 1], x[..., 0])], axis=-1)

    def jacobian(self, x):
        r = np.maximum(np.hypot(x[..., 0], x[..., 1]), 1e-9)
        c, s = x[..., 0] / r, x[..., 1] / r
        return np.stack([np.stack([c, s], -1), np.stack([-s / r, c / r], -1)], -2)

    def noise(self, x):
        return np.diag([self.sigma_range**2, self.sigma_bearing**2])

    def detects(self, x):
        return np.array(0.9)

    def clutter(self, z):
        return np.array(1e-5)

    def invert(self, z, noise=None):
        return converted(z, self.noise(z) if noise is None else noise)


def converted(z, R):
    """Return position and covariance by the first-order conversion."""
    r, c, s = z[..., 0], np.cos(z[..., 1]), np.sin(z[..., 1])
    J = np.stack([np.stack([c, -r * s], -1), np.stack([s, r * c], -1)], -2)
    return vedette.Gaussian(np.stack([r * c, r * s], -1), J @ R @ np.swapaxes(J, -1, -2))


def mutant(**methods):
    return frozen(type("Wrong", (Sonar,), {"kind": "test_wrong_sonar", **methods}))


MUTANTS = {
    "inverts_what_it_measures": mutant(
        invert=lambda s, z, noise=None: vedette.Gaussian(converted(z, s.noise(z)).mean, np.zeros((*z.shape, 2)))
    ),
    "a_sharp_return_inverts_exactly": mutant(invert=lambda s, z, noise=None: converted(z, s.noise(z))),
    "the_usual_noise_is_the_sensors": mutant(
        invert=lambda s, z, noise=None: converted(z, 4 * s.noise(z) if noise is None else noise)
    ),
}


def law_of(name):
    return next(law for law in laws_of(Sonar) if law.name == name)


@pytest.mark.costly
@pytest.mark.parametrize("name", MUTANTS)
def test_the_law_holds_of_the_textbooks_sensor_and_catches_its_mutant(name):
    assert examine(Sonar, law_of(name), components(Sonar), FAST).verdict == "held"
    wrong = MUTANTS[name]
    assert examine(wrong, law_of(name), components(wrong), FAST).verdict == "failed"


def test_states_over_the_sensor_are_moved_and_those_near_are_not():
    x = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, -400.0]])
    assert regular(Sonar(5.0, 0.01), x).tolist() == [[20.0, 20.0], [3.0, 0.0], [0.0, -400.0]]
