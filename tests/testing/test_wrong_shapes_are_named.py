"""A method that gives what it must not is named in every law that it breaks, with what is right."""

from typing import ClassVar, final

import numpy as np
import pytest
from attrs import frozen

from vedette import Gaussian, MotionModel, Sensor, Space
from vedette.testing.kit import examine, laws_of
from vedette.testing.law import Profile
from vedette.testing.strategies import components


@final
@frozen
class WrongShape(MotionModel):
    kind: ClassVar[str] = "test_wrong_shape"

    @property
    def state(self):
        return Space.of(x="m", y="m")

    def move(self, x, dt):
        return np.zeros((3, 3, 3, 7))

    def noise(self, x, dt):
        return np.eye(2)


@final
@frozen
class Stacked(Sensor):
    """Stacks what it measures along the wrong axis, and leaves the derivative to its role."""

    kind: ClassVar[str] = "test_stacked"
    observes = measurement = Space.of(x="m", y="m")

    def measure(self, x):
        return np.stack([x[..., 0], x[..., 1]], axis=0)

    def noise(self, x):
        return np.eye(2)

    def detects(self, x):
        return np.full(x.shape[:-1], 0.9)

    def clutter(self, z):
        return np.zeros(z.shape[:-1])

    def invert(self, z, noise=None):
        return Gaussian(z, np.broadcast_to(np.eye(2), (*z.shape, 2)))


@pytest.mark.parametrize("name", ["pure", "batches_as_it_loops", "inverts_what_it_measures"])
def test_a_measurement_of_the_wrong_shape_is_named_where_what_asks_for_it_fails(name):
    (law,) = [law for law in laws_of(Stacked) if law.name == name]
    outcome = examine(Stacked, law, components(Stacked, {}), Profile.named("fast", 0))
    assert outcome.verdict == "failed"
    assert "Stacked).measure must return (*b, 2) or (2,)" in outcome.text.splitlines()[0]


def test_a_law_that_fails_in_its_own_sums_names_the_method_and_what_it_must_return():
    profile = Profile.named("fast", 0)
    (law,) = [law for law in laws_of(WrongShape) if law.name == "batches_as_it_loops"]
    outcome = examine(WrongShape, law, components(WrongShape, {}), profile)
    assert outcome.verdict == "failed"
    first = outcome.text.splitlines()[0]
    assert "test_wrong_shape" in first
    assert ".move must return (*b, 2) or (2,)" in first
    assert "got (3, 3, 3, 7)" in first
    assert "vedette check" not in first
