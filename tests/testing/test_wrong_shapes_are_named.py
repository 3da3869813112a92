"""A method that gives what it must not is named in every law that it breaks, with what is right."""

from typing import ClassVar, final

import numpy as np
from attrs import frozen

from vedette import MotionModel, Space
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
