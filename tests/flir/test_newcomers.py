"""What nobody marked is confirmed if it moves before its scene and is alone of its kind; a scene's own things are not."""

import numpy as np
import pytest
from attrs import evolve

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Scan
from vedette_flir.estimators import template, template_search, unmarked
from vedette_flir.newcomers import CHANCE, PLACE, TURN, moves, newcomer_odds

SIZE = (140, 180)
STEP = np.array([0.35, 0.1])
"""Pixels a frame: those of a slow target, and of waves."""


def drawn(k, spots, corner=(0.0, 0.0), sign=False):
    """Frame k: a rough scene of which `corner` lies at its first pixel, hot spots of 2 px there, a sign written into it."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(float)
    along, down = x + corner[0], y + corner[1]
    pixels = 60.0 + 6.0 * np.sin(along / 9.0) * np.cos(down / 7.0) + 5.0 * np.sin(0.31 * along + 0.23 * down)
    pixels += np.random.default_rng([5, k]).normal(0.0, 1.0, SIZE)
    for at in spots:
        pixels += 60.0 * np.exp(-((along - at[0]) ** 2 + (down - at[1]) ** 2) / 8.0)
    if sign:
        pixels[20:24, 150:157] = 200.0
    return pixels


def confirmed(frames, corners=None, *, detect_first=True):
    """The places of the tracks that are confirmed at the end of the frames, in px of the scene."""
    made = vedette.load(EXAMPLES / "flir_found.toml", overrides=["preprocessors.spots.most=12"])
    tracker, detector = made.tracker, made.preprocessors["spots"]
    state = tracker.start(seed=1)
    for k, pixels in enumerate(frames):
        frame = Scan.image(k / 30, "camera", Frame(pixels, np.zeros(2) if corners is None else corners[k]))
        spots = Scan(k / 30, "spots", detector.process({"camera": frame}))
        for scan in (spots, frame) if detect_first else (frame, spots):
            state = tracker.step(state, scan)
    return tracker.estimate(state).mean[state.confirmed, :2]


def test_what_stands_moves_as_rarely_as_stated():
    rng = np.random.default_rng(3)
    for turned in (0.0, 4.0, 40.0):
        off = np.hypot(*rng.normal(0.0, np.hypot(PLACE, TURN * turned), (2, 200_000)))
        share = np.mean([moves(d, turned) for d in off])
        assert abs(share - CHANCE) < 4.0 * np.sqrt(CHANCE / 200_000)
    assert moves(1.0, 0.0)
    assert not moves(1.0, 4.0)


def test_odds_rise_with_speed_and_with_being_alone():
    alone, speed = np.meshgrid(np.linspace(-0.2, 1.0, 13), [0.05, 0.2, 1.0, 4.0])
    odds = np.vectorize(newcomer_odds)(alone, speed)
    assert (np.diff(odds, axis=0) > 0).all()
    assert (np.diff(odds, axis=1) > 0).all()


@pytest.mark.costly
def test_one_spot_is_a_target_and_one_among_its_like_is_not(monkeypatch):
    """Waves drift together, each like the next; the same spot alone is confirmed."""
    alone = [drawn(k, [np.array([60.0, 70.0]) + k * STEP]) for k in range(40)]
    (found,) = confirmed(alone)
    np.testing.assert_allclose(found, np.array([60.0, 70.0]) + 39 * STEP, atol=1.0)
    many = [np.array([20.0 + 16.0 * i + 5.0 * (j % 2), 40.0 + 16.0 * j]) for i in range(8) for j in range(5)]
    waves = [drawn(k, [at + k * STEP for at in many]) for k in range(40)]
    assert not len(confirmed(waves))
    monkeypatch.setattr(unmarked, "newcomer_odds", lambda alone, speed: newcomer_odds(1.0, speed))
    assert len(confirmed(waves)) > 3


@pytest.mark.costly
def test_two_that_fly_beside_each_other_are_both_found(monkeypatch):
    """As alike as waves, but two."""
    first, beside = np.array([40.0, 60.0]), np.array([24.0, 4.0])
    pair = [drawn(k, [first + k * STEP, first + beside + k * STEP]) for k in range(40)]
    found = confirmed(pair)
    np.testing.assert_allclose(found[np.argsort(found[:, 0])], first + 39 * STEP + [0.0 * beside, beside], atol=1.0)
    monkeypatch.setattr(template_search, "ALIKE", 1)
    assert len(confirmed(pair)) < 2


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.by_turns
def test_what_is_written_into_frames_is_no_target_where_the_camera_turns(monkeypatch, asked):
    """A sign moves before the scene as the camera turns; asked is whether it moves in the frames."""
    corners = [np.array([0.8 * k, 0.1 * k]) for k in range(40)]
    if not asked:
        monkeypatch.setattr(unmarked, "written", lambda off, turned: False)
        monkeypatch.setattr(unmarked, "moves", lambda off, turned: True)
    sky = [np.where(drawn(k, [], corner, sign=True) > 150.0, 200.0, 60.0) + k % 2 for k, corner in enumerate(corners)]
    assert len(confirmed(sky, corners)) == (0 if asked else 1)


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.by_turns
def test_a_line_drawn_in_inverse_is_no_target_where_the_camera_turns(monkeypatch, asked):
    """Bright over sky and dark over land, it ends at a treeline, and so grows and shrinks as the camera turns along that."""
    if not asked:
        monkeypatch.setattr(unmarked, "written", lambda off, turned: not moves(float(np.hypot(*off)), 0.0))
    corners, frames = [np.array([4.0 * k, 0.0]) for k in range(40)], []
    for k, corner in enumerate(corners):
        frames.append(drawn(k, [], corner))
        edge = 90.0 + 9.0 * np.sin((np.arange(SIZE[1]) + corner[0]) / 25.0)
        frames[-1][np.arange(SIZE[0])[:, None] > edge] += 60.0
        frames[-1][70:, 100:103], frames[-1][70 : int(edge[101]), 100:103] = 20.0, 200.0
    assert len(confirmed(frames, corners)) == (0 if asked else 1)


@pytest.mark.costly
def test_parked_cars_are_no_targets_where_one_after_another_leaves_the_picture():
    """The track of the one that left finds the next: that is far from where it was, but nothing went there."""
    cars, corners = [np.array([150.0 - 24.0 * i, 70.0]) for i in range(3)], [np.array([-2.0 * k, 0.0]) for k in range(50)]
    assert len(confirmed([drawn(k, cars, corner) for k, corner in enumerate(corners)], corners)) == 0


@pytest.mark.parametrize("asked", [True, False], ids=["asked", "not asked"])
@pytest.mark.costly
def test_sparkles_that_follow_each_other_are_no_target(monkeypatch, asked):
    """Each lives for a fifth of a second, 10 px from the one before, as on water; none moves."""
    if not asked:
        monkeypatch.setattr(template, "leaps", lambda off, S: False)
    way = np.random.default_rng(2).uniform(0.0, 2.0 * np.pi, 12)
    at = np.array([80.0, 70.0]) + np.cumsum(10.0 * np.stack([np.cos(way), np.sin(way)], axis=1), axis=0)
    found = confirmed([drawn(k, [at[k // 6]]) for k in range(72)])
    assert len(found) == 0 if asked else len(found) > 0


@pytest.mark.parametrize("mutant", ["none", "frames before what is found in them", "leaps asked of what was seen once"])
@pytest.mark.by_turns
def test_what_flies_seven_px_a_frame_is_found(monkeypatch, mutant):
    """By the next frame it would have left the place where it was found; and how fast it is only the second frame says."""
    step = np.array([7.0, 1.0])
    frames = [drawn(k, [np.array([8.0, 50.0]) + k * step]) for k in range(23)]
    if mutant.startswith("leaps"):
        first = template.TemplateFilter.first

        def seen_before(self, *args):
            match = first(self, *args)
            return evolve(match, appearance=evolve(match.appearance, recent=np.zeros(())))

        monkeypatch.setattr(template.TemplateFilter, "first", seen_before)
    found = confirmed(frames, detect_first=not mutant.startswith("frames"))
    assert len(found) == (1 if mutant == "none" else 0)
    assert mutant != "none" or np.abs(found[0] - np.array([8.0, 50.0]) - 22 * step).max() < 1.0


@pytest.mark.parametrize("flies", [True, False])
@pytest.mark.by_turns
def test_what_goes_along_with_what_is_around_it_is_slow(monkeypatch, flies):
    """A thing of the scene goes .2 px a frame as the camera zooms by .4 %, and hardly before the scene."""
    speeds, frames = list[float](), []
    y, x = np.mgrid[: SIZE[0], : SIZE[1]].astype(float)
    for k in range(30):
        zoom, at = 1.0 if flies else np.exp(0.004 * k), 130.0 + 0.2 * k * flies
        along, down = 89.5 + (x - 89.5) / zoom, 69.5 + (y - 69.5) / zoom
        scene = 6.0 * np.sin(along / 9.0) * np.cos(down / 7.0) + 5.0 * np.sin(0.31 * along + 0.23 * down)
        frames.append(60.0 + scene + 60.0 * np.exp(-((along - at) ** 2 + (down - 40.0) ** 2) / 8.0))

    def odds(alone, speed):
        speeds.append(speed)
        return -2.0

    monkeypatch.setattr(unmarked, "newcomer_odds", odds)
    confirmed(frames)
    assert (len(speeds) > 0 and np.median(speeds) > 0.15) == flies
