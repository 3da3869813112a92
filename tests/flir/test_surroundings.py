"""Whether a thing moves before what is around it, or with it."""

import cv2
import numpy as np
import pytest

from vedette_flir.estimators.surroundings import BESIDE, gone

SIZE, ORIGIN = np.array([5.0, 5.0]), np.array([120.0, 100.0])


def scenes():
    """Counts of trees, of a sky that grows brighter downwards, and of an even one; and which of them show where they are."""
    noise = np.random.default_rng(0).normal(size=(200, 260))
    trees = 100.0 + 160.0 * cv2.GaussianBlur(noise, (0, 0), 2.0)
    return {"trees": trees, "slope": 50.0 + 0.8 * np.mgrid[:200, :260][0], "sky": np.full((200, 260), 50.0)}


def frame(scene, turned, at, seed, zoom=1.0):
    """A frame in which the scene has moved by `turned` and grown around `ORIGIN`, with a hot thing at a place."""
    M = np.column_stack([zoom * np.eye(2), turned + (1.0 - zoom) * ORIGIN])
    moved = cv2.warpAffine(scene, M, (260, 200), borderMode=cv2.BORDER_REPLICATE)
    y, x = np.mgrid[:200, :260]
    thing = 60.0 * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0)
    return moved + thing + np.random.default_rng(seed).normal(0.0, 1.0, moved.shape)


@pytest.mark.parametrize("scene", ["trees", "slope", "sky"])
@pytest.mark.parametrize("turned", [(0, 0), (3, 0), (2, -4), (0, -3), (0, 1.5)], ids=str)
@pytest.mark.parametrize("way", [(0, 0), (3, 0), (2, -4), (5, -2), (4, 1.5)], ids=str)
def test_a_thing_has_gone_as_far_as_its_surroundings_have_not(scene, turned, way):
    """Before trees that is its way less theirs; sky shows nothing, and counts as standing still."""
    picture, way, turned = scenes()[scene], np.array(way, dtype=float), np.array(turned, dtype=float)
    first = BESIDE.around(frame(picture, (0, 0), ORIGIN, 1), ORIGIN, SIZE)
    result = gone(first, frame(picture, turned, ORIGIN + way, 2), ORIGIN + way, ORIGIN, SIZE)
    np.testing.assert_allclose(result, way - turned if scene == "trees" else way, atol=0.3)


@pytest.mark.parametrize("zoom", [0.95, 1.05])
@pytest.mark.parametrize("way", [(0, 0), (3, 0), (2, -4)], ids=str)
def test_how_far_a_thing_went_is_told_whatever_the_zoom(way, zoom):
    picture, way, turned = scenes()["trees"], np.array(way, dtype=float), np.array([1.0, -2.0])
    first = BESIDE.around(frame(picture, (0, 0), ORIGIN, 1), ORIGIN, SIZE)
    result = gone(first, frame(picture, turned, ORIGIN + way, 2, zoom), ORIGIN + way, ORIGIN, SIZE)
    np.testing.assert_allclose(result, way - turned, atol=0.05)


def test_what_a_frame_does_not_show_says_nothing():
    at, way, size = np.array([2.0, 2.0]), np.array([300.0, 0.0]), np.array([1.0, 1.0])
    first = BESIDE.around(frame(scenes()["trees"], (0, 0), at, 1), at, size)
    assert np.isnan(first).any()
    np.testing.assert_allclose(gone(first, frame(scenes()["trees"], (0, 0), at, 2), at + way, at, size), way, atol=0.05)
