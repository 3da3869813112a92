"""A target that stops is held, however it turns then; what was found again is asked for once more while it stands."""

import numpy as np
import pytest
from attrs import evolve

from support.infrared import BY, FILTER, land
from vedette_flir.estimators.earlier import YOUNG, Elsewhere, kept_frame
from vedette_flir.estimators.judged import judged
from vedette_flir.estimators.template_search import NEAR
from vedette_flir.patches import kept

SIZE, BOX = (120, 200), np.array([12.0, 12.0])


@pytest.mark.parametrize(
    ("changed", "held"),
    [
        ({}, True),
        ({"usual": 2.0}, False),  # what stands there is duller than it was
        ({"latest": 0.5}, False),  # it does not look as it did a moment ago
        ({"least": 0.2}, False),  # nor did it look like itself since it moved
    ],
    ids=["stops", "duller", "changes", "changed"],
)
def test_what_stands_as_it_did_a_moment_ago_clear_and_alone_is_the_target(changed, held):
    """It turned, so that it is less like the first frame than as a rule, as what stands where a target vanished is."""
    at = np.array([100.0, 60.0])
    then, now = (
        land(k, [(at, 60.0, wide)], (0.0, 0.0), SIZE, 11, texture=3.0) for k, wide in ((0, (3.4, 1.7)), (30, (2.0, 3.0)))
    )
    known = FILTER.first(then, at, np.array([15.0, 9.0])).appearance
    look = BY.look(now, at, NEAR, known)
    clear, latest = look.clear * changed.get("usual", 1.0), kept(look.shown, float(known.amplitude))
    latest = np.roll(latest, 6, axis=1) if "latest" in changed else latest
    values = {"usual": clear, "usual_first": 0.97, "speed": 4.0, "least": changed.get("least", 0.8)}
    known = evolve(known, latest=latest, **{name: np.asarray(value) for name, value in values.items()})
    look = BY.look(now, at, NEAR, known)
    it = judged(BY, BY, known, now, look, 0.99, look.place - known.offset, at, Elsewhere(known, now, at))
    assert (it.ratio > 0.0) == (it.standing == 0.0) == held


def test_what_was_found_again_is_asked_for_in_the_earlier_frame_until_it_moves():
    start, stands = np.array([60.0, 40.0]), np.array([150.0, 85.0])
    then, now = (
        land(k, [(np.array(at), 60.0, (2.0, 2.0)) for at in spots], (0.0, 0.0), SIZE, 13, texture=3.0, below=0.6)
        for k, spots in ((0, [start, stands]), (20, [stands]))
    )
    known = kept_frame(then, FILTER.first(then, start, BOX).appearance, start, held=True)
    known = evolve(known, earlier_at=known.earlier_at + [0.0, 0.0, YOUNG + 12.0])
    look, elsewhere = BY.look(now, stands, NEAR, known), Elsewhere(known, now, stands)

    def ratio(least):
        seen = evolve(known, least=np.asarray(least))
        return judged(BY, BY, seen, now, look, 0.9, np.full(2, np.nan), stands, elsewhere).ratio

    assert ratio(0.0) < 0.0
    assert ratio(0.5) > 2.0
