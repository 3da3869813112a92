"""Videos as people have them: each is followed from its box, and by itself, to a pixel."""

import tomllib

import cv2
import numpy as np
import pytest

import vedette
from support.spots import gaussian
from vedette_flir.drafting import draft

SHAPE = (120, 160)


def path(k):
    return np.array([40.0 + 1.2 * k, 60.0 + 0.4 * k])


def frame(k, at, *, spread=3.0, peak=70.0, level=60.0, shape=SHAPE):
    """A background of waves with noise, and a spot at a place of (x, y), if any."""
    y, x = np.ogrid[: shape[0], : shape[1]]
    pixels = level + 3.0 * np.sin(x / 17.0) * np.cos(y / 13.0) + np.random.default_rng(k).normal(0.0, 1.5, shape)
    if at is not None:
        pixels += peak * gaussian(x, y, at, (spread, spread))
    return pixels.clip(0, 255).astype(np.uint8)


def usual(k):
    return frame(k, path(k))


def portrait(k):
    return frame(k, path(k)[::-1], shape=SHAPE[::-1])


def black_between(k):
    return 0 * usual(k) if k % 10 == 5 or 30 <= k < 34 else usual(k)


def two_pixels(k):
    return frame(k, path(k), spread=0.8)


def large(k):
    return frame(k, path(k), spread=13.0)


def cold(k):
    return frame(k, path(k), peak=-45.0, level=110.0)


def zoom(k):
    return frame(k, path(k), spread=2.5 * 1.02**k)


def away(k):
    return frame(k, None if 25 <= k < 40 else path(k))


def written(folder, made, count, *, codec="MJPG", rate=30.0, colour=True):
    file = folder / ("clip.avi" if codec == "MJPG" else "clip.mp4")
    size = made(0).shape[::-1]
    writer = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*codec), rate, size, isColor=colour)
    for k in range(count):
        writer.write(cv2.cvtColor(made(k), cv2.COLOR_GRAY2BGR) if colour else made(k))
    writer.release()
    return file


def tracks_of(file, **wishes):
    return vedette.load(tomllib.loads(draft(file, wishes))).run().tracks


@pytest.mark.parametrize(
    ("made", "side", "options"),
    [
        (usual, 10, {"codec": "mp4v", "rate": 60.0}),
        (usual, 10, {"colour": False}),
        (portrait, 10, {}),
        (black_between, 10, {}),
        (two_pixels, 3, {}),
        (large, 40, {}),
        (cold, 10, {}),
        (zoom, 9, {}),
        (away, 10, {}),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
@pytest.mark.by_turns
def test_a_target_in_a_box_is_followed(tmp_path, made, side, options):
    file = written(tmp_path, made, 50, **options)
    first, last = (path(k)[::-1] if made is portrait else path(k) for k in (0, 49))
    x, y = first - 0.5 * (side - 1) + 1.0  # corners are counted from 1
    (track,) = tracks_of(file, box=[f"{x},{y},{side},{side}"])
    assert len(track.times) == 50
    assert np.abs(track.mean[-1, :2] - last).max() < 1.0
    assert track.existence[-1] > 0.9


@pytest.mark.parametrize("made", [usual, portrait, black_between, large, zoom])
@pytest.mark.costly
def test_a_target_that_nobody_marked_is_followed(tmp_path, made):
    (track,) = tracks_of(written(tmp_path, made, 50))
    assert np.abs(track.mean[-1, :2] - (path(49)[::-1] if made is portrait else path(49))).max() < 1.0


def test_a_video_of_ten_frames_has_a_track_by_its_box(tmp_path):
    (track,) = tracks_of(written(tmp_path, usual, 10), box=["36.5,56.5,10,10"])
    assert len(track.times) == 10
    assert np.abs(track.mean[-1, :2] - path(9)).max() < 1.0


@pytest.mark.costly
def test_a_gif_with_times_of_its_own_is_followed(tmp_path):
    file, image = tmp_path / "clip.gif", pytest.importorskip("PIL.Image")
    frames = [image.fromarray(usual(k)) for k in range(40)]
    frames[0].save(file, save_all=True, append_images=frames[1:], duration=40)  # ms
    (track,) = tracks_of(file)
    assert track.times[-1] == pytest.approx(39 * 0.04)
    assert np.abs(track.mean[-1, :2] - path(39)).max() < 1.5


@pytest.mark.parametrize("shape", [(1, 50), (50, 1)])
def test_in_a_single_row_of_pixels_no_box_is_followed(tmp_path, shape):
    cv2.imwrite(str(tmp_path / "0.png"), np.full(shape, 90, np.uint8))
    with pytest.raises(vedette.ConfigError, match=r"--box: .* 2 x 2 px"):
        tracks_of(tmp_path, box=["1,1,1,1"])
