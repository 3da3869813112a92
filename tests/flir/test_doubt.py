"""A tracker that knows when it has lost: doubt of the template filter, and the lifecycle of a target that comes back."""

import math

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES, recording
from vedette import Frame, Gaussian, Scan
from vedette.testing import conformance
from vedette_flir.lifecycles.reappearing import ReappearingTarget
from vedette_flir.sources.boxes import read_boxes

TestReappearingTarget = conformance(
    ReappearingTarget,
    known_failures={
        "survival_is_a_probability": "a target that is away comes back with time: that is what this lifecycle is for",
        "what_does_not_exist_is_not_confirmed": "its tracks are given, and so confirmed, held or lost",
        "unseen_tracks_end": "its tracks go on, as their target may come back after any time",
    },
)


def scene(k, shown):
    """A frame of 90 x 120 px with noise of a count, and a warm spot of 25 counts that crosses it, where it is `shown`."""
    y, x = np.mgrid[:90, :120]
    pixels = 50.0 + np.random.default_rng(k).normal(0.0, 1.0, x.shape)
    at = np.array([30.0 + 0.5 * k, 40.0])
    return pixels + shown * 25.0 * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / 18.0), at


@pytest.fixture(scope="module")
def followed():
    """Existence, hit, spread and error of the example's tracker, frame by frame; the target is away in frames 60 to 99."""
    tracker = vedette.load(EXAMPLES / "flir_clip.toml").tracker
    prior = np.zeros((1, len(tracker.state)))
    for name, value in {"x": 30.0, "y": 40.0, "width": 12.0, "height": 12.0}.items():
        prior[0, tracker.state.names.index(name)] = value
    state, rows = tracker.start(Gaussian(prior, np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None]), 0.0), []
    for k in range(130):
        pixels, at = scene(k, not 60 <= k < 100)
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        estimate = tracker.estimate(state)
        off = float(np.hypot(*(estimate.mean[0, :2] - at)))
        rows.append((state.existence[0], state.hit[0], math.sqrt(estimate.cov[0, 0, 0]), off))
    return np.array(rows).T


@pytest.mark.costly
def test_existence_hit_and_covariance_follow_what_stands_out(followed):
    existence, hit, spread, off = followed
    assert existence[:60].min() > 0.9
    assert off[:60].max() < 2.0
    assert existence[70:100].max() < 0.1
    assert hit[70:100].max() < 0.1
    assert spread[99] > 5.0 * spread[59]


@pytest.mark.costly
def test_what_comes_back_is_found_again(followed):
    existence, _, spread, off = followed
    assert existence[115:].min() > 0.9
    assert off[115:].max() < 2.0
    assert spread[129] == pytest.approx(spread[59], rel=0.2)


def test_a_target_comes_back_as_a_markov_chain_says():
    chain = ReappearingTarget(shown=4.0, away=1.0)
    rates = np.array([[-1 / 4.0, 1 / 4.0], [1 / 1.0, -1 / 1.0]])
    steps = np.linalg.matrix_power(np.eye(2) + rates * 1e-5, 70_000)
    np.testing.assert_allclose(chain.predict(np.array([1.0, 0.0]), 0.7), steps[:, 0], rtol=1e-4)
    np.testing.assert_allclose(chain.predict(chain.predict(np.array([0.3]), 0.2), 0.5), chain.predict(np.array([0.3]), 0.7))


@pytest.mark.nightly("eight clips: a minute")
def test_recorded_clips_run_whole():
    """Across cuts most targets are found again; of lost frames beyond ten of an episode .7 are doubted, of good ones .06."""
    folder = recording("ir_clips")
    offsets = dict(row.split(",")[:2] for row in (folder / "segments.csv").read_text().split()[1:])
    doubted, falsely, near = [], [], []
    for clip, offset in offsets.items():
        found = vedette.load(EXAMPLES / "flir_clip.toml", overrides=[f"source.path={folder / clip}.mp4"]).run()
        track, labels = found.tracks[0], read_boxes(folder / f"{clip}_truth.csv", 1.0)
        numbers = np.rint(track.times * 30).astype(int) + int(offset)
        boxes = np.array([labels.get(number, np.full(4, np.nan)) for number in numbers])
        error, size = np.hypot(*(track.mean[:, :2] - boxes[:, :2]).T), boxes[:, 2:].max(axis=1)
        lost, doubt, run = ~(error <= np.maximum(15.0, size)), track.existence < 0.5, 0
        for k, gone in enumerate(lost):
            run = run + 1 if gone else 0
            if run > 10:
                doubted.append(doubt[k])
        falsely += doubt[error <= np.maximum(5.0, 0.35 * size)].tolist()
        near += (error[np.isfinite(error)] <= 10.0).tolist()
    assert np.mean(near) >= 0.75  # .51 where nothing is sought after a cut
    assert np.mean(doubted) >= 0.7
    assert np.mean(falsely) <= 0.06


@pytest.mark.costly
def test_a_run_says_when_its_target_was_lost_and_found_again(tmp_path):
    import cv2

    from vedette.cli import main

    folder = tmp_path / "frames"
    folder.mkdir()
    for k in range(125):
        pixels, _ = scene(k, not 60 <= k < 100)
        cv2.imwrite(str(folder / f"{k:03d}.png"), pixels.clip(0, 255).astype(np.uint8))
    out = tmp_path / "out"
    box = ["--set", f"source.path={folder}", "--set", "source.box=[25, 35, 13, 13]"]
    assert main(["run", str(EXAMPLES / "flir_clip.toml"), "--out", str(out), *box]) == 0
    rows = [row.split(",") for row in (out / "episodes.csv").read_text().splitlines()]
    assert [row[2] for row in rows] == ["event", "lost", "found again"]
    assert 60 / 30 <= float(rows[1][1]) < 2.5  # frame 60 is the first that does not show it
    assert 100 / 30 <= float(rows[2][1]) < 115 / 30
    video = cv2.VideoCapture(str(out / "annotated.avi"))
    red = []
    while (read := video.read())[0]:
        image = read[1].astype(int)
        red.append(int(np.sum((image[..., 2] - image[..., 1] > 100) & (image[..., 1] - image[..., 0] < 60))))
    assert max(red[:55]) < 20 < min(red[75:95])
