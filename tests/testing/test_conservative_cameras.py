"""A camera that claims less than its frames say keeps the laws if it declares that it is `conservative`."""

import pytest

from support.mutants.declared import EYE, SPOT, told
from support.mutants.table import QUICK, mutant
from vedette.testing import examine, laws_of
from vedette.testing.strategies import components

HALF = told(SPOT, lambda J, g, llr: (J / 2, g / 2, llr / 2))


@pytest.mark.parametrize(("declared", "verdict"), [({}, "failed"), ({"conservative": True}, "held")])
def test_half_of_what_a_frame_says_is_right_only_where_it_is_declared(declared, verdict):
    camera = mutant(SPOT, HALF | declared)
    law = next(law for law in laws_of(camera) if law.name == "frames_inform_as_stated")
    outcome = examine(camera, law, components(camera, EYE), QUICK)
    assert outcome.verdict == verdict, outcome.text
