"""Changes of scene, and a target that is sought in the whole frame."""

from itertools import pairwise

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette import Frame, Gaussian, Scan
from vedette_flir.scene_changes import BLOCKS, change, is_cut, outline


def field(seed, size=(90, 120)):
    """A smooth background, with 15 counts of spread."""
    y, x = np.mgrid[: size[0], : size[1]]
    down, across = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, 2)
    return 100.0 + 30.0 * np.sin(x / 20.0 + across) * np.cos(y / 20.0 + down)


def frame(k, at, scene=0, peak=80.0):
    y, x = np.mgrid[:90, :120]
    noise = np.random.default_rng(k).normal(0.0, 1.0, x.shape)
    return field(scene) + noise + peak * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 8.0)


def followed(scenes, path, **options):
    """Error and existence of the example's tracker, frame by frame."""
    overrides = [f"estimator.{name}={value}" for name, value in options.items()]
    tracker = vedette.load(EXAMPLES / "flir_clip.toml", overrides=overrides).tracker
    mean = np.array([[*path[0], 0.0, 0.0, 9.0, 9.0]])
    state, rows = tracker.start(Gaussian(mean, np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None]), 0.0), []
    for k, (scene, at) in enumerate(zip(scenes, path, strict=True)):
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(frame(k, at, scene, 80.0 if at[0] > 0 else 0.0))))
        off = tracker.estimate(state).mean[0, :2] - at
        rows.append((np.hypot(*off), state.existence[0]))
    return np.array(rows).T


def test_an_outline_is_of_means_and_has_none_itself():
    pixels = np.kron(np.arange(256.0).reshape(16, 16), np.ones((4, 4)))
    np.testing.assert_allclose(outline(pixels), np.arange(256.0).reshape(16, 16) - 127.5)
    assert outline(np.zeros((7, 300), np.uint8)).shape == (BLOCKS, BLOCKS)


@pytest.mark.parametrize("depth", [np.uint8, np.uint16])
def test_a_cut_is_told_from_noise_and_from_a_camera_that_moves(depth):
    seen = [outline((np.roll(field(0), 2 * k, axis=1) + frame(k, (60, 40)) - field(0)).astype(depth)) for k in range(8)]
    changes = [change(a, b) for a, b in pairwise(seen)]
    assert not any(is_cut(seen[i], seen[i + 1], max(changes[:i]), 0.3) for i in range(1, 7))
    other = outline(frame(9, (60, 40), scene=1).astype(depth))
    assert is_cut(seen[-1], other, max(changes), 0.3)


@pytest.mark.costly
def test_a_target_that_is_away_after_a_cut_is_doubted_at_once():
    path = [np.array([30.0 + k, 40.0]) for k in range(30)] + [np.array([-99.0, 0.0])] * 20
    _, existence = followed([0] * 30 + [1] * 20, path)
    assert existence[:30].min() > 0.9
    assert existence[33:].max() < 0.5
    _, plain = followed([0] * 30 + [1] * 20, path, cut=99)
    assert np.sum(plain[30:] < 0.5) <= np.sum(existence[30:] < 0.5)


@pytest.mark.costly
def test_a_target_that_a_cut_leaves_in_place_stays():
    error, existence = followed([0] * 25 + [1] * 15, [np.array([30.0 + k, 40.0]) for k in range(40)])
    assert existence[5:].min() > 0.5
    assert error[5:].max() < 2.0


def test_a_target_that_jumps_with_a_cut_is_found_in_the_whole_frame():
    path = [np.array([20.0 + 0.5 * k, 20.0]) for k in range(20)] + [np.array([95.0, 70.0 - 0.5 * k]) for k in range(20)]
    error, existence = followed([0] * 20 + [1] * 20, path, search=8)
    assert error[:20].max() < 2.0
    assert error[35:].max() < 2.0
    assert existence[35:].min() > 0.9


@pytest.mark.parametrize("spread", [2.0, 4.0])
def test_what_a_target_changes_before_a_plain_sky_is_no_cut(spread):
    """However dim it is: what noise changes in all other blocks is not taken for a part of it."""
    y, x = np.mgrid[:90, :120]
    spot = np.exp(-((x - 60.0) ** 2 + (y - 40.0) ** 2) / (2.0 * spread**2))
    noise = [np.random.default_rng([11, k]).normal(0.0, 1.0, x.shape) for k in range(30)]
    for peak in (40.0, 120.0, 200.0):
        seen = [outline(50.0 + (k < 29) * peak * spot + each) for k, each in enumerate(noise)]
        recent = max(change(a, b) for a, b in pairwise(seen[:-1]))
        assert change(seen[-2], seen[-1]) > max(0.3 * np.std(seen[-2]), 3.0 * recent)  # large beside a plain sky
        assert not is_cut(seen[-2], seen[-1], recent, 0.3)
        assert is_cut(seen[-2], outline(frame(3, (60, 40), scene=1)), recent, 0.3)
