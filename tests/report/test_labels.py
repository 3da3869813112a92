"""Words on maps hide one another nowhere; what has no room is left out, and counted."""

import numpy as np
import pytest
from matplotlib import pyplot as plt

from vedette_report.drawing import canvas
from vedette_report.drawing.labels import Label, write


def label(text, x, y):
    return Label(text, np.array([x, y]), canvas.INK, {"weight": "bold"})


@pytest.mark.parametrize("down", [False, True])
@pytest.mark.by_turns
def test_words_do_not_overlap_and_those_without_room_are_counted(down):
    rng = np.random.default_rng(1)
    labels = [label(f"target {i}", *at) for i, at in enumerate(rng.uniform(0, 100, (150, 2)))]
    made, axes = plt.subplots(figsize=(8, 6), layout="constrained")
    axes.set(xlim=(0, 100), ylim=(0, 100), aspect="equal")
    if down:
        axes.invert_yaxis()
    lacking = write(axes, [*labels, label("outside", 200.0, 0.0)])
    assert 0 < lacking == 150 - len(axes.texts)
    assert axes.texts[0].get_text() == "target 0"  # the first ones first
    made.draw_without_rendering()
    boxes = [text.get_window_extent() for text in axes.texts]
    assert not [i for i, box in enumerate(boxes) for other in boxes[:i] if box.overlaps(other)]
    plt.close(made)


def test_words_at_one_place_stand_around_it():
    made, axes = plt.subplots()
    axes.set(xlim=(0, 10), ylim=(0, 10))
    assert write(axes, [label(name, 5.0, 5.0) for name in "abcde"]) == 1
    assert {(text.get_ha(), text.xyann[1] > 0) for text in axes.texts} == {
        (side, above) for side in ("left", "right") for above in (True, False)
    }
    plt.close(made)
