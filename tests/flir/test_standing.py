"""A held target that comes to stand in the scene while the camera turns is told if it looks unlike itself there; one that
the camera follows stands in the frames alone, and is held.
"""

import numpy as np
import pytest
from attrs import evolve

from support import infrared
from vedette_flir.estimators import judged
from vedette_flir.estimators.standing import stood

SIZE, TURN = (100, 160), np.array([0.7, 0.3])


def seen(k, parts):
    """Frame k of a land that a camera passes, with spots at places of it: place, peak and spread of each."""
    return infrared.land(k, parts, TURN, SIZE, 4)


def path(k):
    return np.array([30.0 + 1.2 * k, 50.0])


def followed(frames):
    """Existence (s,) of the example's track of a spot that is at `path(0)` first, and its place (s, 2) in the scene."""
    existence, place = infrared.followed(frames, [*path(0), 10.0, 10.0])
    return existence, place + np.outer(np.arange(len(place)), TURN)


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.costly
def test_a_mast_before_which_a_target_vanishes_is_told_where_the_camera_turns(monkeypatch, asked):
    if not asked:
        monkeypatch.setattr(judged, "stood", lambda appearance, *_: (appearance, False))
        monkeypatch.setattr(judged, "scene_ratio", lambda *_, **__: 0.0)
    mast = (path(38), 50.0, (1.3, 4.0))
    faded = [(path(k), 60.0 * float(np.interp(k, [30, 40], [1.0, 0.0])), (2.0, 2.0)) for k in range(90)]
    existence, place = followed([seen(k, [one, mast]) for k, one in enumerate(faded)])
    assert existence[:30].min() > 0.9
    assert np.abs(place[60:] - path(38)).max() < 3.0
    assert existence[60:].max() < 0.5 if asked else existence[60:].min() > 0.5


@pytest.mark.costly
def test_a_target_that_stops_is_held_where_the_camera_turns():
    existence, place = followed([seen(k, [(path(min(k, 30)), 60.0, (2.0, 2.0))]) for k in range(80)])
    assert existence.min() > 0.9
    assert np.abs(place[-1] - path(30)).max() < 0.5


@pytest.mark.costly
def test_a_target_that_turns_back_is_held():
    """Within 8 frames it comes back to where it was, and looks otherwise than before; but it does not stand."""
    across = [path(40 - abs(40 - k)) for k in range(60)]
    spread = [(2.0 + 0.015 * k, 2.0 - 0.01 * k) for k in range(60)]
    existence, _ = followed([seen(k, [(at, 60.0, size)]) for k, (at, size) in enumerate(zip(across, spread, strict=True))])
    assert existence.min() > 0.9


def stands(monkeypatch, frames):
    """In which of the frames the track of a spot is told to stand (s - 1,)."""
    told = []

    asked = judged.stood

    def spied(appearance, *given):
        appearance, stood_there = asked(appearance, *given)
        told.append(stood_there)
        return appearance, stood_there

    monkeypatch.setattr(judged, "stood", spied)
    followed(frames)
    return np.array(told)


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.by_turns
def test_a_target_that_a_camera_follows_does_not_stand(monkeypatch, asked):
    """From frame 25 on it stands in the frames, and what is around it passes; the mutant sees the frames alone."""

    def in_frames(appearance, *given):
        return stood(evolve(appearance, path=np.full_like(appearance.path, np.nan)), *given)

    if not asked:
        monkeypatch.setattr(judged, "stood", in_frames)
    frames = [seen(max(k - 25, 0), [(path(0) + k * TURN, 60.0, (2.0, 2.0))]) for k in range(55)]
    assert np.any(stands(monkeypatch, frames)) == (not asked)


@pytest.mark.parametrize("flies", [True, False], ids=["flies, and stops", "hovers"])
@pytest.mark.by_turns
def test_who_stands_as_a_rule_has_not_come_to_stand(monkeypatch, flies):
    frames = [seen(0, [(path(min(k, 30) * flies), 60.0, (2.0, 2.0))]) for k in range(55)]
    assert np.any(stands(monkeypatch, frames)) == flies
