"""A part of the scene was there before a track came to it; a target was not, however long it hovers."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.infrared import land
from support.paths import EXAMPLES
from support.spots import gaussian
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators import judged, template
from vedette_flir.estimators.seen_before import remembered
from vedette_flir.estimators.template_search import Matcher

SIZE = (100, 220)


def seen(k, spots, turn, texture=5.0):
    """Frame k of a land that a camera passes by `turn` px a frame, and spots in it: place, peak, spread of each."""
    return land(k, spots, turn, SIZE, 9, texture=texture)


def path(k, speed=1.2):
    return np.array([100.0 + speed * k, 50.0])


def followed(monkeypatch, frames):
    """Existence (s,) of the example's track of a spot that is at `path(0)` first, and what is remembered of it."""
    told, looks = [], []

    def spied(by, appearance, *given):
        appearance, new, changed = remembered(by, appearance, *given)
        looks.append((new, appearance.path.copy()))
        return appearance, new, changed

    monkeypatch.setattr(judged, "remembered", spied)
    tracker, existence = vedette.load(EXAMPLES / "flir_clip.toml").tracker, []
    prior = Gaussian(np.array([[*path(0), 0.0, 0.0, 10.0, 10.0]]), np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None])
    state = tracker.start(prior, 0.0)
    for k, pixels in enumerate(frames):
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        existence.append(float(state.existence[0]))
        told += looks[:1]  # the target as it is known, before any look at its negative
        looks.clear()
    return np.array(existence), np.array([new for new, _ in told]), np.array([way for _, way in told])


TURNS = pytest.mark.parametrize("turn", [(0.0, 0.0), (0.7, 0.3), (1.2, 0.0)], ids=["stands", "turns", "follows"])


@TURNS
@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.costly
def test_a_spot_like_the_target_that_was_there_before_is_told(monkeypatch, turn, asked):
    """The target fades where the spot is, whose likeness to it stays above .95: only that it was there says what it is."""
    if not asked:
        monkeypatch.setattr(judged, "scene_ratio", lambda *_, **__: 0.0)
    tip = (path(38), 55.0, (2.0, 2.0))
    faded = [(path(k), 60.0 * float(np.interp(k, [32, 40], [1.0, 0.0])), (2.0, 2.0)) for k in range(75)]
    existence, new, _ = followed(monkeypatch, [seen(k, [one, tip], turn) for k, one in enumerate(faded)])
    assert existence[:30].min() > 0.9
    assert existence[55:].max() < 0.5 if asked else existence[55:].min() > 0.5
    assert not asked or np.nanmax(new[45:]) < 0.45


@TURNS
@pytest.mark.parametrize("land", [5.0, 0.0], ids=["land", "sky"])
@pytest.mark.by_turns
def test_a_target_that_stops_and_looks_otherwise_there_is_held(monkeypatch, turn, land):
    def grows(k):
        return (2.0 + 0.02 * max(k - 30, 0), 2.0 - 0.01 * max(k - 30, 0))

    frames = [seen(k, [(path(min(k, 30)), 60.0, grows(k))], turn, land) for k in range(90)]
    existence, new, _ = followed(monkeypatch, frames)
    assert existence.min() > 0.9
    assert np.nanmin(new) > 0.5


@TURNS
@pytest.mark.parametrize("speed", [0.3, 1.2, 4.0])
@pytest.mark.costly
def test_how_far_it_went_in_the_scene_is_known_whatever_the_camera_does(monkeypatch, turn, speed):
    """What is remembered is renewed on the way, several times where the target is fast."""
    frames = [seen(k, [(path(k, speed), 60.0, (2.0, 2.0))], turn) for k in range(min(int(110 / speed), 80))]
    _, new, way = followed(monkeypatch, frames)
    went = np.hypot(*(way[:, -1] - way[:, 0]).T)
    known = np.isfinite(went)
    assert known[10:].mean() > 0.8
    np.testing.assert_allclose(went[known], 7.0 * speed, atol=1.0)  # each place errs by .3 px
    assert abs(np.mean(went[known]) - 7.0 * speed) < 0.3
    assert np.isfinite(new).mean() > 0.3
    assert np.nanmin(new) > 0.8


@pytest.mark.costly
def test_another_scene_says_nothing(monkeypatch):
    rng = np.random.default_rng(1)
    scenes = [40.0 * rng.normal(size=SIZE).cumsum(axis=1) / 9.0 for _ in range(8)]
    spots = [seen(0, [(path(k), 60.0, (2.0, 2.0))], (0, 0), 0.0) for k in range(40)]
    _, new, way = followed(monkeypatch, [spots[k] + scenes[k // 5] for k in range(40)])
    assert np.isnan(way[:, -1] - way[:, 0]).all()
    assert not np.any(new < 0.5)


@pytest.mark.parametrize("peak", [60.0, 120.0])
@pytest.mark.parametrize(("speed", "ahead"), [(0.3, 8.0), (0.3, 16.0), (1.2, 16.0)])
@pytest.mark.by_turns
def test_a_target_that_follows_another_is_held(monkeypatch, speed, ahead, peak):
    """The other was where the target is now, yet is no part of the scene: it is as far ahead now."""
    places = [path(k, speed) for k in range(80)]
    spots = [[(at, 60.0, (2.0, 2.0)), (at + [ahead, 0.0], peak, (2.0, 2.0))] for at in places]
    existence, *_ = followed(monkeypatch, [seen(k, both, (0.0, 0.0)) for k, both in enumerate(spots)])
    assert existence.min() > 0.9


@pytest.mark.costly
def test_a_frame_that_shows_another_scene_does_not_shift_what_is_remembered(monkeypatch):
    frames = [seen(k, [(path(k, 2.0), 60.0, (2.0, 2.0))], (0.0, 0.0), -50.0 if k % 12 == 11 else 5.0) for k in range(55)]
    *_, way = followed(monkeypatch, frames)
    went = np.hypot(*(way[:, -1] - way[:, 0]).T)
    known = np.isfinite(went)
    assert known.sum() > 10
    np.testing.assert_allclose(went[known], 14.0, atol=1.0)


@pytest.mark.costly
def test_a_target_that_comes_nearer_is_held(monkeypatch):
    """It goes less far than it grows: what was there before was itself, and no part of the scene."""
    places = [path(k, 0.35) for k in range(80)]
    frames = [seen(k, [(at, 60.0, (2.0 + 0.1 * k, 2.0 + 0.1 * k))], (0.0, 0.0)) for k, at in enumerate(places)]
    existence, new, _ = followed(monkeypatch, frames)
    assert existence.min() > 0.9
    assert not np.any(new < 0.45)


@pytest.mark.parametrize("turn", [(0.0, 0.0), (1.2, 0.0)], ids=["stands", "follows"])
@pytest.mark.parametrize("grows", [1.5, 2.0])
@pytest.mark.costly
def test_how_new_a_target_that_has_grown_is_stays_known(monkeypatch, turn, grows):
    """What is around it is remembered as widely as it has grown: else it is known in .73 and .5 of the frames."""
    monkeypatch.setitem(globals(), "SIZE", (100, 400))
    sizes = 2.0 * np.interp(np.arange(200), [0, 60], [1.0, grows])
    frames = [seen(k, [(path(k, 1.4), 60.0, (size, size))], turn) for k, size in enumerate(sizes)]
    existence, new, _ = followed(monkeypatch, frames)
    assert existence.min() > 0.9
    assert np.isfinite(new[80:]).mean() > 0.85
    assert np.nanmin(new) > 0.8


def test_a_target_that_is_found_again_larger_has_grown_by_that_alone():
    unseen = vedette.load(EXAMPLES / "flir_clip.toml").tracker.estimator.unseen(())
    found = Matcher(36, 0.3, 1.3, 2.5, 40.0).scaled(evolve(unseen, size=np.array([8.0, 6.0]), growth=np.asarray(0.4)), 2.0)
    np.testing.assert_allclose(found.grown, 2.0 * np.exp(0.4) * np.array([8.0, 6.0]))
    np.testing.assert_allclose(found.growth, 0.4 + np.log(2.0))


@pytest.mark.parametrize("late", [True, False], ids=["of late", "as learned alone"])
@pytest.mark.by_turns
def test_a_target_that_has_turned_is_new(monkeypatch, late):
    """It lay and stands: its template follows slowly, and by that alone it is less new."""
    if not late:
        monkeypatch.setattr(template, "LATEST", 0.0)
    share = np.interp(np.arange(60), [25, 37], [0.0, 1.0])[:, None]
    turned = (1.0 - share) * [4.0, 1.2] + share * [1.2, 4.0]
    frames = [seen(k, [(path(k), 60.0, each)], (0.0, 0.0)) for k, each in enumerate(turned)]
    _, new, _ = followed(monkeypatch, frames)
    assert (np.nanmin(new) > 0.82) == late


def before_masts(k, start, speed, bright, wide):
    """Frame k of a sky with masts, which a target of 60 count hides where it flies before them."""
    y, x = np.ogrid[: SIZE[0], : SIZE[1]]
    masts = bright / (1.0 + np.exp((np.abs((x - 120.0 + 40.0) % 80.0 - 40.0) - 0.5 * wide) / 0.7))
    target = gaussian(x, y, start + [speed * k, 0.0], (3.0, 2.0))
    hides = np.minimum(1.5 * target, 1.0)
    return 60.0 + (1.0 - hides) * masts + 60.0 * target + np.random.default_rng([11, k]).normal(0.0, 1.0, SIZE)


@pytest.mark.parametrize("bright", [90.0, 120.0])
@pytest.mark.parametrize(("speed", "wide"), [(0.4, 5.0), (0.8, 5.0), (0.8, 8.0)])
@pytest.mark.by_turns
def test_a_target_that_hides_what_is_brighter_is_held(monkeypatch, speed, wide, bright):
    """What is there is fainter than what was there before: a target that only added to it would be told as lost."""
    frames = [before_masts(k, path(0), speed, bright, wide) for k in range(int(60 / speed))]
    existence, *_ = followed(monkeypatch, frames)
    assert np.mean(existence < 0.5) < 0.02
