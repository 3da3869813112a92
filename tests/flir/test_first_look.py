"""A first frame that does not show its target: how that looks is told by the first frame that shows it in its box."""

import numpy as np
import pytest

from support import infrared
from vedette_flir.estimators import template

SIZE, FRAMES = (60, 160), 40


def path(k):
    return np.array([40.0 + 1.2 * k, 30.0])


def drawn(peak, *others):
    """Frames of a land, a spot on its path, as high as `peak(k)`, and others: where they are and how high."""
    spots = [[(at(k), high(k), (2.5, 2.0)) for at, high in ((path, peak), *others)] for k in range(FRAMES)]
    return [infrared.land(k, each, (0.0, 0.0), SIZE, 7) for k, each in enumerate(spots)]


def off(frames, k=FRAMES - 1):
    """By how many px the track is off the path in a frame."""
    return float(np.hypot(*(infrared.followed(frames, [*path(0), 16.0, 12.0])[1][k] - path(k))))


@pytest.mark.parametrize("late", [1, 3, 5])
@pytest.mark.costly
def test_a_target_that_appears_in_its_box_soon_after_is_followed(monkeypatch, late):
    frames = drawn(lambda k: 60.0 * (k >= late))
    assert off(frames) < 1.0
    monkeypatch.setattr(template, "DIM", 0.0)
    assert off(frames) > 2.0  # what the box showed first is taken for a part of the target


def test_what_appears_beside_a_target_that_is_seen_is_another():
    assert off(drawn(lambda k: 60.0, (lambda k: path(k) + [0.0, 9.0 - 1.5 * k], lambda k: 90.0 * (k > 1)))) < 1.5


def test_what_flies_past_a_box_that_shows_nothing_is_not_its_target(monkeypatch):
    frames = drawn(lambda k: 0.0, (lambda k: np.array([40.0 + 3.0 * (k - 4), 45.0]), lambda k: 60.0))
    found = off(frames, 12)
    monkeypatch.setattr(template, "DIM", 0.0)
    assert found == off(frames, 12)
