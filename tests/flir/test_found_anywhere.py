"""Automatic start does not depend on how frames come: their size, depth, polarity, times, or the kind of file."""

import tomllib

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.spots import gaussian
from vedette import Frame, Scan
from vedette_flir.drafting import draft

COUNT, SPEED = 45, np.array([30.0, 12.0])
"""Frames, and px a second."""


def scene(shape):
    """A rough background, brighter to one side, of a frame of (rows, columns)."""
    y, x = np.ogrid[: shape[0], : shape[1]]
    return 80.0 + 15.0 * x / shape[1] + 4.0 * np.sin(x / 11.0) * np.cos(y / 9.0)


def seen(k, t, shape, start=(30.0, 30.0), speed=SPEED):
    """Counts of frame k at time t, 0 to 255, and where its spot is."""
    y, x = np.ogrid[: shape[0], : shape[1]]
    at = np.array(start) + speed * t
    spot = 60.0 * gaussian(x, y, at, (2.0, 2.0))
    return scene(shape) + spot + np.random.default_rng(k).normal(0.0, 1.5, shape), at


def started(shape=(120, 160), change=lambda pixels: pixels, times=None, **options):
    """The tracks that are confirmed at the end: places (k, 2), when the first was, and where the spot is then."""
    made = vedette.load(EXAMPLES / "flir_found.toml", overrides=[f"{name}={value}" for name, value in options.items()])
    tracker, detector, first = made.tracker, made.preprocessors["spots"], np.inf
    state, times = tracker.start(seed=1), np.arange(COUNT) / 30.0 if times is None else times
    for k, t in enumerate(times):
        pixels, at = seen(k, t, shape)
        frame = Scan.image(t, "camera", Frame(change(pixels)))
        state = tracker.step(state, Scan(t, "spots", detector.process({"camera": frame})))
        state = tracker.step(state, frame)
        first = min(first, t) if state.confirmed.any() else first
    return tracker.estimate(state).mean[state.confirmed, :2], first - times[0], at


LARGE = pytest.param((1080, 1920), marks=pytest.mark.nightly("45 large frames: 15 s"))


@pytest.mark.parametrize("shape", [(60, 80), (120, 160), (160, 120), (256, 320), (480, 640), LARGE])
@pytest.mark.by_turns
def test_frames_of_any_size(shape):
    (found,), when, at = started(shape)
    assert when <= 1.0
    np.testing.assert_allclose(found, at, atol=1.0)


@pytest.mark.parametrize(
    "change",
    [
        lambda pixels: pixels.clip(0, 255).astype(np.uint8),
        lambda pixels: (7000.0 + 40.0 * pixels).astype(np.uint16),
        lambda pixels: (200.0 * pixels).astype(np.uint16),
        lambda pixels: (20000.0 + 2.0 * pixels).astype(np.uint16),
    ],
    ids=["8 bit", "14 bit over an offset", "16 bit", "16 bit of little contrast"],
)
@pytest.mark.costly
def test_counts_of_any_depth(change):
    """Gain and offset change nothing but rounding."""
    (plain,), *_ = started()
    (found,), when, _ = started(change=change)
    assert when <= 1.0
    np.testing.assert_allclose(found, plain, atol=0.4)


@pytest.mark.costly
def test_a_dark_target_is_a_hot_one_of_the_negative():
    plain, when, _ = started()
    dark, later, _ = started(change=lambda pixels: 255.0 - pixels, **{"preprocessors.spots.polarity": "'dark'"})
    both, _, _ = started(change=lambda pixels: 255.0 - pixels, **{"preprocessors.spots.polarity": "'both'"})
    assert when == later
    np.testing.assert_allclose(dark, plain, atol=0.05)
    np.testing.assert_allclose(both, plain, atol=0.05)
    assert not len(started(change=lambda pixels: 255.0 - pixels)[0])


TIMES = {
    "60 frames a second": np.arange(2 * COUNT) / 60.0,
    "9 frames a second": np.arange(24) / 9.0,
    "of two rates in turn": np.cumsum(np.tile([1 / 60, 1 / 20], COUNT // 2)),
    "with jitter": np.arange(COUNT) / 30.0 + np.random.default_rng(1).uniform(-0.01, 0.01, COUNT),
    "with frames left out": np.delete(np.arange(COUNT + 12) / 30.0, [5, 6, 11, 12, 13, 18, 25, 26, 33, 34, 35, 36]),
    "with a gap": np.concatenate([np.arange(12), np.arange(27, 60)]) / 30.0,
}


@pytest.mark.parametrize("times", TIMES.values(), ids=TIMES)
@pytest.mark.by_turns
def test_frames_at_any_times(times):
    (found,), when, at = started(times=times)
    assert when <= max(1.0, times[20] - times[0])
    np.testing.assert_allclose(found, at, atol=1.0)


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
@pytest.mark.costly
def test_a_folder_of_images_is_the_frames_that_it_holds(tmp_path, depth):
    (tmp_path / "clip").mkdir()
    for k in range(COUNT):
        pixels = seen(k, k / 30.0, (120, 160))[0] * (1 if depth is np.uint8 else 200)
        cv2.imwrite(str(tmp_path / "clip" / f"{k:04d}.png"), pixels.astype(depth))
    (track,) = vedette.load(tomllib.loads(draft(tmp_path / "clip", {}))).run().tracks
    (plain,), *_ = started()
    np.testing.assert_allclose(track.mean[-1, :2], plain, atol=0.4)


@pytest.mark.costly
def test_in_frames_of_more_pixels_a_target_may_be_as_many_times_faster(tmp_path):
    shape, speed = (160, 640), np.array([440.0, 60.0])
    for k in range(COUNT - 5):
        pixels, at = seen(k, k / 30.0, shape, speed=speed)
        cv2.imwrite(str(tmp_path / f"{k:04d}.png"), pixels.astype(np.uint8))
    config = draft(tmp_path, {})
    (track,) = vedette.load(tomllib.loads(config)).run().tracks
    np.testing.assert_allclose(track.mean[-1, :2], at, atol=2.0)
    assert "vx = 200.0, vy = 200.0" in config
    assert "vx = 200.0, vy = 200.0" in draft(tmp_path, {"box": ["20,20,12,12"]})
