"""The picture of a run through images: the first frame behind the track, y down, as in the image."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from support.results import words
from vedette_report.drawing.picture import picture


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    """Axes of the picture, and the run: a disc that moves to the right, away from frame 25 on."""
    import cv2

    folder = tmp_path_factory.mktemp("frames")
    y, x = np.mgrid[:60, :100]
    for k in range(60):
        disc = ((x - 20 - k) ** 2 + (y - 15) ** 2 <= 16) * (k < 25)
        image = np.where(disc, 180, 40) + np.random.default_rng(k).normal(0, 1.5, x.shape)
        cv2.imwrite(str(folder / f"{k:02d}.png"), image.astype(np.uint8))
    given = vedette.load(EXAMPLES / "flir_clip.toml", overrides=[f"source.path={folder}", "source.boxes=[[17, 12, 9, 9]]"])
    result = given.run()
    return picture(given, result).axes[0], result


@pytest.mark.costly
def test_the_map_has_the_orientation_and_the_limits_of_the_image(drawn):
    axes, _ = drawn
    assert axes.get_xlim() == (-0.5, 99.5)
    assert axes.get_ylim() == (59.5, -0.5)
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("x [px]", "y [px]")


@pytest.mark.costly
def test_the_first_frame_stands_behind_the_track_pixel_by_pixel(drawn):
    axes, result = drawn
    (image,) = axes.images
    assert image.get_extent() == [-0.5, 99.5, 59.5, -0.5]
    np.testing.assert_array_equal(image.get_array(), result.framed[0].frame.pixels)
    assert image.get_array()[15, 20] > 150  # the disc, where the track begins
    np.testing.assert_allclose(result.tracks[0].mean[0, :2], [20, 15], atol=1.5)
    assert image.get_zorder() < min(line.get_zorder() for line in axes.lines)


def test_what_is_lost_is_no_thick_line(drawn):
    axes, result = drawn
    held = result.tracks[0].existence >= 0.5
    assert 0 < np.sum(held) < len(held)
    thick = next(line for line in axes.lines if line.get_linewidth() == 3.0)
    np.testing.assert_array_equal(np.isfinite(thick.get_xdata()), held)
    assert "lost, or new" in [text.get_text() for text in axes.figure.legends[0].get_texts()]
    assert not any("not drawn" in word for word in words(axes.figure))
