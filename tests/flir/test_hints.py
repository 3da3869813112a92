"""A lost target's likely place: it is taken once it moves before its scene, not while it stands there."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators import hints, judged

SIZE = (120, 160)


def drawn(k, scene, at, spread, corner=(0.0, 0.0)):
    """Frame k of one of two scenes, of which `corner` lies at its first pixel, and a hot spot at a place of the scene."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(float)
    along, down = x + corner[0] + 57.0 * scene, y + corner[1] + 31.0 * scene
    pixels = 100.0 + 14.0 * np.sin(along / 9.0) * np.cos(down / 7.0) + 30.0 * np.sin(along / 33.0 + 2.0 * scene)
    off = ((along - 57.0 * scene - at[0]) / spread[0]) ** 2 + ((down - 31.0 * scene - at[1]) / spread[1]) ** 2
    return pixels + 90.0 * np.exp(-0.5 * off) + np.random.default_rng([9, k]).normal(0.0, 1.0, SIZE)


def after_a_cut(step, spread, turn=0.0):
    """Existence and error in px in the last of 20 frames after a cut, behind which the target looks otherwise."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    mean = np.array([[30.0, 40.0, 0.0, 0.0, 11.0, 11.0]])
    state = tracker.start(Gaussian(mean, np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None]), 0.0)
    for k in range(45):
        at, corner = np.array([30.0 + 0.8 * k, 40.0]), np.zeros(2)
        if k >= 25:
            at, corner = np.array([60.0 + step * (k - 25), 85.0]), np.array([turn * (k - 25), 0.0])
        pixels = drawn(k, int(k >= 25), at, (2.5, 2.5) if k < 25 else spread, corner)
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
    return state.existence[0], float(np.hypot(*(tracker.estimate(state).mean[0, :2] - at + corner)))


def standing_counts_for_nothing(monkeypatch):
    monkeypatch.setattr(judged, "stood", lambda appearance, *_: (appearance, False))


@pytest.mark.parametrize("spread", [(7.0, 2.5), (7.0, 4.0)])
@pytest.mark.costly
def test_a_likely_place_is_taken_once_it_moves_before_its_scene(monkeypatch, spread):
    """What looks otherwise than the target is it if it flies; if it stands it is not, also where the camera turns."""
    existence, error = after_a_cut(1.2, spread)
    assert existence > 0.9
    assert error < 3.0
    for turn in (0.0, 1.2):
        assert after_a_cut(0.0, spread, turn)[0] < 0.5
    monkeypatch.setattr(hints, "MOVING", 0.0)
    assert after_a_cut(1.2, spread)[0] < 0.5


def test_where_a_turning_camera_is_not_asked_for_what_stands_is_taken(monkeypatch):
    standing_counts_for_nothing(monkeypatch)
    monkeypatch.setattr(hints, "gone", lambda first, pixels, place, origin, size: place - origin)
    assert after_a_cut(0.0, (7.0, 4.0), 1.2)[0] > 0.5
