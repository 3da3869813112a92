"""The grid of drawn scenes: the same twice, and judged by a measure that is 0 of the truth."""

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.drafts import MOTIONS, drawn, gospa
from vedette import Space


@pytest.mark.costly
def test_scenes_are_drawn_alike_and_differ():
    one, again = drawn(3, 1), drawn(3, 1)
    assert one.about == again.about
    assert np.array_equal(one.rows, again.rows)
    scenes = [drawn(i, 1) for i in range(40)]
    assert {scene.about["motion"] for scene in scenes} == set(MOTIONS)
    assert all(scene.about["clutter"] == 0 for scene in scenes if scene.about["single"])
    assert np.ptp([np.log10(scene.about["speed"]) for scene in scenes]) > 2


def test_the_measure_is_0_of_the_truth_and_counts_what_lacks_and_what_is_too_much():
    """A miss and a false track cost half the cut-off each, an error what it is of the cut-off."""
    scene = next(one for i in range(40) if (one := drawn(i, 1)).about["objects"] == 3)
    space, cut = Space.of(x="m", y="m"), 10 * scene.about["error"]
    right = [SimpleNamespace(space=space, times=scene.times, mean=path) for path in scene.paths]
    assert gospa(scene, right) == (0.0, 1.0)
    assert gospa(scene, right[1:]) == pytest.approx((0.5 / 3, 2 / 3))
    far = SimpleNamespace(space=space, times=scene.times, mean=scene.paths[0] + 1e9)
    assert gospa(scene, [*right, far]) == pytest.approx((0.5 / 3, 1.0))
    off = [SimpleNamespace(space=space, times=scene.times, mean=path + [0.1 * cut, 0.0]) for path in scene.paths[:1]]
    assert gospa(scene, [*off, *right[1:]]) == pytest.approx((0.1 / 3, 1.0))
