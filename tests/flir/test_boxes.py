"""What a user gives a video: boxes that start tracks and judge nothing, colour that is converted on request."""

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import ConfigError
from vedette.metrics import judge
from vedette_flir.sources.images import grey_of

EXAMPLE = EXAMPLES / "flir_clip.toml"


def discs(folder, frames=15, colour=False):
    """Two discs of 8 px that move apart, as images in a folder; the boxes of the first frame, counted from 1."""
    folder.mkdir()
    y, x = np.mgrid[:60, :120]
    noise = np.random.default_rng(0)
    for k in range(frames):
        both = sum((x - at) ** 2 + (y - 30) ** 2 <= 16 for at in (40 - k, 80 + k))
        image = (60 + 120.0 * both + noise.normal(0, 1.5, x.shape)).astype(np.uint8)
        image = np.stack([0 * image, image, image], axis=-1) if colour else image
        cv2.imwrite(str(folder / f"{k:03d}.png"), image)
    return folder, [[37, 27, 9, 9], [77, 27, 9, 9]]


def run(path, *overrides):
    return vedette.load(EXAMPLE, overrides=[f"source.path={path}", *overrides]).run()


def test_a_box_alone_judges_nothing(tmp_path):
    path, boxes = discs(tmp_path / "discs")
    result = run(path, f"source.box={boxes[0]}")
    score = judge(result.tracks, result.recording.truth, result.scans, vedette.load(EXAMPLE).judge)
    assert result.recording.truth == ()
    assert (score.coverage, score.position_rmse_m) == (None, None)
    assert np.hypot(*(result.tracks[0].mean[-1, :2] - [40 - 14, 30])) < 1.5


def test_each_of_several_boxes_starts_a_track(tmp_path):
    path, boxes = discs(tmp_path / "discs")
    result = run(path, f"source.boxes={boxes}")
    assert len(result.tracks) == 2
    for track, at in zip(result.tracks, (40 - 14, 80 + 14), strict=True):
        assert np.hypot(*(track.mean[-1, :2] - [at, 30])) < 1.5


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("source.box=[500, 20, 9, 9]", r"source\.box: must lie.*503"),
        ("source.box=[1, -30, 9, 9]", r"source\.box: must lie in the image"),
        ("source.boxes=[[37, 27, 9, 9], [200, 1, 9, 9]]", r"source\.boxes\[1\]: must lie in the image"),
        ("source.boxes=[[37, 27, 9]]", r"source\.boxes: must be rows of \[x, y, w, h\].*got 3 numbers"),
        ("source.boxes=[[37, 27, 0, 9]]", r"source\.boxes\[0\]: must be \[x, y, w, h\] with w and h > 0"),
    ],
)
def test_a_box_outside_the_image_is_told(tmp_path, change, told):
    path, _ = discs(tmp_path / "discs", frames=2)
    with pytest.raises(ConfigError, match=told):
        run(path, change)


@pytest.mark.costly
def test_colour_is_converted_on_request(tmp_path):
    path, boxes = discs(tmp_path / "discs", colour=True)
    with pytest.raises(vedette.InputError, match="colour"):
        run(path, f"source.box={boxes[0]}", "source.grey=equal")
    by_default, stated = (
        run(path, f"source.box={boxes[0]}", *grey).tracks[0].mean for grey in ((), ("source.grey=luminance",))
    )
    np.testing.assert_array_equal(by_default, stated)
    for grey in ("luminance", "red", "green"):
        result = run(path, f"source.box={boxes[0]}", f"source.grey={grey}")
        assert np.hypot(*(result.tracks[0].mean[-1, :2] - [40 - 14, 30])) < 1.5


def test_grey_levels_are_those_of_opencv():
    image = np.random.default_rng(0).integers(0, 256, (9, 7, 3)).astype(np.uint8)
    assert np.max(np.abs(grey_of(image, "luminance").astype(int) - cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))) <= 1
    for k, name in enumerate(("blue", "green", "red")):
        np.testing.assert_array_equal(grey_of(image, name), image[..., k])
