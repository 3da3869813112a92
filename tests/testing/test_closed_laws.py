"""A law that does not apply to some of what is drawn: what it found on the rest counts."""

import numpy as np
import pytest
from attrs import frozen
from hypothesis import strategies as st

from vedette import Associator, Sensor, WrappedSensor, fields, kernels
from vedette.testing import FAST, examine, laws_of
from vedette.testing.comparisons import Broken, Closed
from vedette.testing.law import Law
from vedette.testing.strategies import components
from vedette_standard.motion.constant_velocity import ConstantVelocity


def never_above_four(motion, drawn):
    """Always wrong, but only motions of much noise are judged, and the kit looks for the smallest that fails."""
    if motion.sigma_accel <= 4.0:
        raise Closed("it hardly moves")
    raise Broken("it moves")


@pytest.mark.costly
def test_a_failure_counts_though_the_law_does_not_apply_to_smaller_examples():
    drawn = components(ConstantVelocity, {"sigma_accel": st.floats(0.0, 5.0, exclude_min=True)})
    outcome = examine(ConstantVelocity, Law(never_above_four), drawn, FAST)
    assert (outcome.verdict, outcome.text.splitlines()[0]) == ("failed", "it moves")


@frozen
class Fading(WrappedSensor):
    """Wrong: wherever it stands, echoes fade with the range from the origin; that of a position is never placed."""

    kind = "test_fading_from_the_origin"
    of: Sensor = fields.part("the sensor near by")
    reach: float = fields.quantity("m", "range at which 1/e of the detections are left", at_least=300, at_most=3000)

    def detects(self, x):
        return self.of.detects(x) * np.exp(-((np.linalg.norm(x[..., :2], axis=-1) / self.reach) ** 4))


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.costly
def test_a_wrapper_that_forgets_where_it_stands_is_found_whatever_it_is_drawn_around(seed):
    law = next(law for law in laws_of(Fading) if law.name == "sees_from_where_it_stands")
    outcome = examine(Fading, law, components(Fading), type(FAST).named("fast", seed))
    assert outcome.verdict == "failed"
    assert outcome.text.startswith("detects, placed[")


@frozen
class Enumerating(Associator):
    """Right, but it has no room for many returns."""

    kind = "test_enumerating"

    def associate(self, scores, evidence):
        if scores.shape[-1] > 20:
            raise MemoryError
        return kernels.softmax(scores)


def test_an_associator_that_enumerates_beyond_the_memory_is_told_so_and_not_failed():
    law = next(law for law in laws_of(Enumerating) if law.name == "every_return_counts")
    outcome = examine(Enumerating, law, components(Enumerating), FAST)
    assert outcome.verdict == "skipped"
    assert "more memory than there is" in outcome.text
