"""Is it there, and where is it: what is told of targets before a treeline, that fade, hide, leave, or meet another one."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.spots import gaussian
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators import judged
from vedette_flir.evidence import (
    LAG,
    UNLIKE,
    found_ratio,
    held_ratio,
    learned,
    presence_ratio,
    ring_spread,
    scene_ratio,
    standing_ratio,
)

SKY = (100, 160)


def sky(k):
    """Frame k of a plain sky, with noise of a count and a half."""
    return 60.0 + np.random.default_rng([7, k]).normal(0.0, 1.5, SKY)


def spot(at, peak, spread=(2.0, 2.0)):
    y, x = np.ogrid[: SKY[0], : SKY[1]]
    return peak * gaussian(x, y, at, spread)


def trees(edge):
    """What a wood adds below a row, its crowns of different brightness."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[: SKY[0], : SKY[1]]
    crown = edge + 2.0 * np.sin(x / 5.0) + 1.5 * np.sin(x / 2.3)
    return (y > crown) * (60.0 + 12.0 * rng.normal(size=SKY))


def followed(frames, starts, *overrides, size=10.0):
    """Existence (s, t) and place (s, t, 2) of the example's tracks, from boxes of 10 px or another size at their starts."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml", overrides=overrides).tracker
    mean = np.array([[*at, 0.0, 0.0, size, size] for at in starts])
    prior = Gaussian(mean, np.repeat(np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None], len(starts), 0))
    state, rows = tracker.start(prior, 0.0), []
    for k, pixels in enumerate(frames):
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        rows.append((state.existence.copy(), tracker.estimate(state).mean[:, :2].copy()))
    return np.array([row[0] for row in rows]), np.array([row[1] for row in rows])


def path(k):
    return np.array([40.0 + 0.8 * k, 40.0])


def uneven(times):
    """Error in px, existence, and error of the velocity in px/s, of a target that flies 24 px/s, seen at these times."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = Gaussian(np.array([[*path(0), 0.0, 0.0, 10.0, 10.0]]), np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None])
    state, rows = tracker.start(prior, 0.0), []
    for k, t in enumerate(times):
        state = tracker.step(state, Scan.image(t, "camera", Frame(sky(k) + spot(path(30 * t), 60.0))))
        mean = tracker.estimate(state).mean[0]
        rows.append((np.hypot(*(mean[:2] - path(30 * t))), state.existence[0], np.hypot(*(mean[2:4] - [24.0, 0.0]))))
    return np.array(rows).T


KEPT = np.random.default_rng(9).uniform(size=100) > 0.5


@pytest.mark.parametrize(
    "times",
    [np.arange(100)[KEPT] / 30, np.delete(np.arange(120), np.s_[40:100]) / 30, np.arange(100) / 60, np.arange(40) / 10],
    ids=["half dropped", "a gap of 2 s", "60 a second", "10 a second"],
)
@pytest.mark.by_turns
def test_times_of_frames_need_not_be_even(times):
    error, existence, velocity = uneven(times)
    assert np.sum(existence < 0.5) <= 1  # in the frame after a gap, which may show another scene
    assert error[3:].max() < 1.5
    assert np.median(velocity[15:]) < 8.0


@pytest.mark.costly
def test_a_frame_shown_twice_changes_nothing_of_a_held_target():
    """As players fill a lower rate: the target stands for a frame, and is neither doubted nor lost."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = Gaussian(np.array([[*path(0), 0.0, 0.0, 10.0, 10.0]]), np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None])
    state = tracker.start(prior, 0.0)
    for i in range(120):
        k = i // 2
        state = tracker.step(state, Scan.image(i / 60, "camera", Frame(sky(k) + spot(path(k), 60.0))))
        assert state.existence[0] > 0.5
        assert np.hypot(*(tracker.estimate(state).mean[0, :2] - path(k))) < 1.5


@pytest.mark.costly
def test_a_target_that_nears_a_treeline_is_held():
    frames = [sky(k) + trees(np.interp(k, [20, 50], [95.0, 54.0])) + spot(path(k), 60.0) for k in range(80)]
    existence, place = followed(frames, [path(0)])
    assert existence.min() > 0.5
    assert np.abs(place[:, 0] - [path(k) for k in range(80)]).max() < 2.5


@pytest.mark.costly
def test_a_cloud_edge_is_no_loss():
    x = np.arange(SKY[1])
    cloud = 25.0 / (1.0 + np.exp(-(x - 75.0) / 6.0))
    existence, place = followed([sky(k) + cloud + spot(path(k), 60.0) for k in range(80)], [path(0)])
    assert existence.min() > 0.5
    assert np.abs(place[-1, 0] - path(79)).max() < 2.5


@pytest.mark.parametrize("fading", [1, 20], ids=["behind a pole", "fades"])
@pytest.mark.costly
def test_what_is_gone_is_told_and_found_again(fading):
    def peak(k):
        return 60.0 * float(np.interp(k, [30, 30 + fading, 70, 71], [1.0, 0.0, 0.0, 1.0]))

    pole = np.zeros(SKY)
    if fading == 1:
        pole[:, 62:100] = -30.0
    existence, place = followed([sky(k) + pole + spot(path(k), peak(k)) for k in range(110)], [path(0)])
    assert existence[:30].min() > 0.9
    assert existence[40 + fading : 70].max() < 0.5
    assert existence[86:].min() > 0.5
    assert np.abs(place[86:, 0] - [path(k) for k in range(86, 110)]).max() < 2.5


@pytest.mark.costly
def test_a_target_that_leaves_the_picture_is_told():
    existence, _ = followed([sky(k) + spot((90.0 + 2.0 * k, 40.0), 60.0) for k in range(90)], [(90.0, 40.0)])
    assert existence[:30].min() > 0.9
    assert existence[50:].max() < 0.5


@pytest.mark.costly
def test_a_bird_that_crosses_is_not_taken_for_the_target():
    def bird(k):
        return spot((120.0 - 2.5 * k, 40.0 + 0.5 * (k - 24)), 40.0, spread=(1.0, 1.0))

    existence, place = followed([sky(k) + spot(path(k), 60.0) + bird(k) for k in range(60)], [path(0)])
    assert existence[-1] > 0.9
    assert np.abs(place[-1, 0] - path(59)).max() < 2.0


@pytest.mark.costly
def test_a_mast_before_which_a_target_vanishes_is_told():
    """It is as bright, and nothing else is near; but it stands, and is of another shape."""
    mast = spot(path(38), 45.0, spread=(1.3, 4.0))

    def faded(k):
        return spot(path(k), 60.0 * float(np.interp(k, [30, 40], [1.0, 0.0])))

    existence, place = followed([sky(k) + np.maximum(faded(k), mast) for k in range(90)], [path(0)])
    assert existence[:30].min() > 0.9
    assert existence[60:].max() < 0.5
    assert np.abs(place[60:, 0] - path(38)).max() < 2.0  # the place is still that of what is most like it


@pytest.mark.costly
def test_a_target_that_stops_is_held():
    existence, place = followed([sky(k) + spot(path(min(k, 30)), 60.0) for k in range(80)], [path(0)])
    assert existence.min() > 0.9
    assert np.abs(place[-1, 0] - path(30)).max() < 0.5


@pytest.mark.costly
def test_a_target_that_stands_in_noise_is_held():
    """The first template is noisy, too: no frame is as like it as it is itself."""
    rng = np.random.default_rng(2)
    existence, place = followed([60.0 + spot(path(0), 40.0) + rng.normal(0.0, 8.0, SKY) for _ in range(80)], [path(0)])
    assert existence.min() > 0.9
    assert np.abs(place - path(0)).max() < 2.0


def test_a_track_that_stands_is_doubted_as_it_grows_unlike():
    likes = np.linspace(0.99, 0.3, 30)
    standing = [standing_ratio(like, 0.97, np.nan) for like in likes]
    assert standing[0] == 0.0  # a target that stops looks as it did
    assert np.all(np.diff(standing) <= 0)
    assert standing[-1] < -15.0
    assert standing_ratio(1.0 - UNLIKE, 1.0, np.nan) == pytest.approx(0.0, abs=1e-9)  # as in any frame


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.costly
def test_a_target_that_stops_and_turns_is_held(monkeypatch, asked):
    """It has not left its own place, so that nothing was seen there before, and grows unlike its first look."""
    if not asked:
        monkeypatch.setattr(judged, "SAME", 2.0)
    turned = np.interp(np.arange(130), [36, 96], [0.0, 1.0])
    spots = [spot((50.0 + 0.5 * min(k, 36), 50.0), 60.0, (5.0 + 3.0 * t, 5.0 - 2.0 * t)) for k, t in enumerate(turned)]
    existence, _ = followed([sky(k) + shown for k, shown in enumerate(spots)], [(50.0, 50.0)], size=26.0)
    assert existence.min() > 0.9 if asked else existence.min() < 0.1


def test_how_far_a_track_went_is_counted_in_the_scene_and_from_where_it_was_found():
    """Over `LAG` frames; a camera that turns does not move it, and a target found elsewhere has not been anywhere yet."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = Gaussian(np.array([[*path(0), 0.0, 0.0, 10.0, 10.0]]), np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None])
    state, corner = tracker.start(prior, 0.0), np.zeros(2)
    for k in range(12):
        corner = np.array([3.0 * k, 0.0])
        frame = Frame(sky(k) + spot(path(0) - corner + [30.0, 0.0], 60.0), corner - [30.0, 0.0])
        state = tracker.step(state, Scan.image(k / 30, "camera", frame))
        past = state.belief.past[0]
        assert np.isnan(past[:, 0]).sum() == max(LAG - 1 - k, 0)
    assert np.abs(past - path(0)).max() < 1.0


def test_the_ring_is_robust_to_what_stands_on_one_side():
    image = np.random.default_rng(1).normal(0.0, 2.0, (80, 80))
    level, spread = ring_spread(image, np.array([40.0, 40.0]), np.array([8.0, 8.0]))
    assert level == pytest.approx(0.0, abs=0.3)
    assert spread == pytest.approx(3.0, rel=0.1)  # 2 and the count that it is at least
    image[58:] += 100.0
    assert ring_spread(image, np.array([40.0, 40.0]), np.array([8.0, 8.0]))[1] < 1.5 * spread


@pytest.mark.costly
def test_a_box_that_shows_nothing_is_told():
    """Along a dark band all places are like each other: a track slides along it. A spot beside its twin is one."""
    band = -35.0 * np.exp(-0.5 * ((np.mgrid[: SKY[0], : SKY[1]][0] - 40.0) / 14.0) ** 2)
    existence, place = followed([60.0 + band + 0.2 * (sky(k) - 60.0) for k in range(60)], [path(0)])
    assert abs(place[-1, 0, 0] - 40.0) > 5.0
    assert existence[30:].max() < 0.5
    twins = [sky(k) + spot(path(k), 40.0) + spot(path(k) + [0.0, 14.0], 40.0) for k in range(40)]
    assert followed(twins, [path(0)])[0].min() > 0.9


def test_evidence_rises_with_each_of_its_parts():
    grid = np.linspace(0.0, 1.0, 11)
    for rising in (
        [held_ratio(0.8, margin, 0.5) for margin in grid],
        [held_ratio(likeness, 0.4, 9.0) for likeness in grid],
        [held_ratio(0.9, 0.05, clear) for clear in 5.0 * grid],
        [scene_ratio(new, 0.1, dull=False) for new in grid],
        [found_ratio(likeness, 0.4, 10.0, 1.0, 1.0, 1.0) for likeness in grid],
        [found_ratio(0.8, margin, 10.0, 1.0, 1.0, 1.0) for margin in grid],
        [found_ratio(0.8, 0.4, clear, 1.0, 1.0, 1.0) for clear in 3.0 + 20.0 * grid],
        [found_ratio(0.8, 0.4, 10.0, again, 1.0, 1.0) for again in grid],
        [found_ratio(0.8, 0.4, 10.0, 1.0, 0.1 + bright, 1.0) for bright in grid],
        [found_ratio(0.8, 0.4, 10.0, 1.0, 1.0, 0.1 + large) for large in grid[:10]],
    ):
        assert np.all(np.diff(rising) >= 0)
        assert rising[-1] > rising[0]
    assert held_ratio(0.9, 0.6, 9.0) > 0 > held_ratio(0.5, 0.05, 9.0)
    assert scene_ratio(np.nan, 0.0, dull=False) == 0.0


def test_ratios_are_those_of_the_page():
    """The equations of docs/measured/flir-evidence.md, written again."""
    for m, usual, c, f, d, e, a, z in np.random.default_rng(5).uniform(0.0, 1.0, (200, 8)):
        m, c, d, a, z = 1.4 * m - 0.2, 3.0 * c, 20.0 * d, 0.25 + 2.0 * a, 0.3 + 2.0 * z
        held = min(10.2 * f + 2.5 * m - 7.2, 20.0 * max(m, 0.0) + c - 2.0)
        assert held_ratio(f, m, c) == pytest.approx(held)
        found = 3.3 * f + 3.5 * m + 1.2 * np.log(max(d, 3.0) / 3.0) + 2.5 * min(max(np.log(2.0 * c), -2.0), 0.0) - 4.9
        found += 1.6 * min(np.log(a), 0.0) - 0.5 * abs(np.log(z))
        assert found_ratio(f, m, d, c, a, z) == pytest.approx(found)
        assert found_ratio(f, m, d, c, a, z, same_scene=True) == pytest.approx(found - 4.0 * abs(np.log(z)))
        standing = -8.0 * min(max(np.log((1.0 - f) / max(1.0 - usual, 0.05)), 0.0), 3.0)
        assert standing_ratio(f, usual, np.nan) == pytest.approx(standing)
        assert standing_ratio(f, usual, e) == pytest.approx(standing if e <= 0.85 else 0.0)
        against = -30.0 * max(0.45 - e - 0.1 * m, 0.0)
        assert scene_ratio(e, 0.1 * m, dull=True) == pytest.approx(against)
        assert scene_ratio(e, 0.1 * m, dull=False) == pytest.approx(against + 15.0 * max(e - 0.1 * m - 0.7, 0.0))
        assert presence_ratio(held, e, cut=False, anew=False) == pytest.approx(held / 3.0)
        assert presence_ratio(held, e, cut=True, anew=False) == pytest.approx(held / 3.0 - 7.0)
        share = 1.0 / (1.0 + np.exp(-min(np.log(e / (1.0 - e)), 2.0) - held)) / (1.0 + np.exp(-10.0 * m))
        assert learned(held, e, 10.0 * m) == pytest.approx(share)


def test_what_is_found_anew_has_the_odds_of_its_frame():
    for existence in (0.01, 0.3, 0.9):
        ratio = presence_ratio(2.0, existence, cut=False, anew=True)
        odds = existence / (1.0 - existence) * np.exp(ratio)
        assert odds == pytest.approx(np.exp(2.0))
