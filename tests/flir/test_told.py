"""What a run through frames tells its user: a lost target, an even image, and where words and boxes are drawn."""

import cv2
import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.cli import main
from vedette_flir import annotation

EXAMPLE = str(EXAMPLES / "flir_clip.toml")
BOX = "source.box=[18, 28, 7, 7]"


def clip(folder, leaves=99, contrast=120, frames=24):
    """A disc that stands at 20, 30 until it leaves, as images in a folder."""
    folder.mkdir()
    y, x = np.mgrid[:60, :80]
    noise = np.random.default_rng(0)
    for k in range(frames):
        disc = contrast * ((x - 20) ** 2 + (y - 30) ** 2 <= 9) * (k < leaves)
        pixels = 60 + disc + (noise.normal(0, 1.5, x.shape) if contrast else 0)
        cv2.imwrite(str(folder / f"{k:03d}.png"), np.broadcast_to(pixels, x.shape).astype(np.uint8))
    return folder


def told(capsys, command, folder, *further):
    code = main([command, EXAMPLE, "--set", f"source.path={folder}", "--set", BOX, *further])
    out, err = capsys.readouterr()
    return code, " ".join((out + err).split())


@pytest.mark.costly
def test_the_summary_tells_of_a_lost_target(tmp_path, capsys):
    folder = clip(tmp_path / "clip", leaves=8)
    track = vedette.load(EXAMPLE, overrides=[f"source.path={folder}", BOX]).run().tracks[0]
    lost = int(np.count_nonzero(track.existence < 0.5))
    assert lost > 5
    code, text = told(capsys, "run", folder, "--stream", "--out", str(tmp_path / "out"))
    assert code == 0
    assert "camera 24 frames time" in text
    assert f"a target was lost in {lost} of 24 frames, where existence is below one half; at the end: 1 Are" in text
    assert "LOOKS WRONG" not in text


def test_an_even_image_is_told_in_the_words_of_images(tmp_path, capsys):
    folder = clip(tmp_path / "clip", contrast=0)
    code, text = told(capsys, "run", folder, "--stream", "--out", str(tmp_path / "out"))
    assert code == 0
    assert "LOOKS WRONG there were tracks in 24 frames, and in none of them was a target found: does it stand out" in text
    assert "nothing to judge by: no confirmed track took a return" in text


def test_consistency_says_that_frames_are_no_returns(tmp_path, capsys):
    code, text = told(capsys, "consistency", clip(tmp_path / "clip", frames=4))
    assert code == 2
    assert "source: gives frames of a camera alone, and no returns to judge by; `vedette run` tells" in text


@pytest.mark.parametrize("value", ["18", "[[18, 28, 7, 7]]", '["18", "28"]', '"18,28,7,7"'])
def test_what_is_no_list_of_numbers_is_told_so(tmp_path, capsys, value):
    code = main(["run", EXAMPLE, "--set", f"source.path={tmp_path}", "--set", f"source.box={value}"])
    assert code == 2
    assert "source.box: must be a list of numbers" in capsys.readouterr().err


def test_an_enlarged_part_covers_no_box():
    image, zoomed = np.zeros((240, 320, 3), np.uint8), np.full((120, 120, 3), 9, np.uint8)
    annotation._put(image, zoomed, [(30, 70, 50, 90), (250, 30, 270, 50)])
    assert image[239, 319].tolist() == list(annotation.TEXT)
    assert image[230, 300].tolist() == [9, 9, 9]
    assert not image[:119].any()
    assert not image[:, :199].any()
    everywhere = [(x, y, x + 9, y + 9) for x in (20, 280) for y in (20, 200)]
    image[:] = 0
    annotation._put(image, zoomed, everywhere)
    assert not image.any()


def test_nothing_is_enlarged_outside_the_image():
    image = np.zeros((120, 160, 3), np.uint8)
    assert annotation._enlarged(image, 1, np.array([170.0, 60.0])) is None
    assert annotation._enlarged(image, 1, np.array([80.0, -3.0])) is None
    assert annotation._enlarged(image, 1, np.array([150.0, 60.0])).shape == (60, 60, 3)


@pytest.mark.parametrize("at", [(400, 60), (-90, -90), (150, 1), (100, 999)])
def test_words_stay_in_the_image(at):
    image = np.zeros((120, 160, 3), np.uint8)
    annotation._write(cv2, image, "lost", at, annotation.LOST, 1)
    inside = np.zeros((120, 160, 3), np.uint8)
    annotation._write(cv2, inside, "lost", (60, 60), annotation.LOST, 1)
    assert np.count_nonzero(image[..., 2]) == np.count_nonzero(inside[..., 2]) > 50
