"""The size that is reported: it follows a target that grows, says its doubt, and changes nothing of the tracking."""

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES, recording
from vedette import Frame, Gaussian, Scan
from vedette_flir.sizes import DOUBT, grown, spread_of


def frame(k, at, sigma, peak=90.0):
    y, x = np.mgrid[:90, :120]
    noise = np.random.default_rng(k).normal(0.0, 1.0, x.shape)
    return 60.0 + noise + peak * np.exp(-((x - at[0]) ** 2 + (y - at[1]) ** 2) / (2.0 * sigma**2))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_spread_is_that_of_what_stands_out_and_follows_its_scale(sign):
    at = np.array([60.0, 40.0])
    found = [spread_of(frame(0, at, sigma, 90.0 * sign), at, np.full(2, 5.0 * sigma), sign) for sigma in (2.0, 4.0)]
    assert found[1] / found[0] == pytest.approx(2.0, rel=0.12)
    y, x = np.mgrid[:90, :120]
    box = 60.0 + 90.0 * ((np.abs(x - 60) <= 8) & (np.abs(y - 40) <= 3))
    assert spread_of(box, at, np.array([17.0, 7.0]), 1.0) == pytest.approx(np.sqrt(17.0 * 7.0 / 12.0), rel=0.12)


def test_a_spread_is_unknown_without_contrast_and_where_the_background_is_as_bright():
    at, box = np.array([60.0, 40.0]), np.full(2, 9.0)
    assert np.isnan(spread_of(np.full((90, 120), 60.0), at, box, 1.0))
    trees = frame(0, at, 2.0)
    trees[38:43, :] = 150.0
    assert np.isnan(spread_of(trees, at, box, 1.0))


def test_growth_settles_at_part_of_the_logarithm_of_the_spread():
    growth = 0.0
    for _ in range(400):
        growth = grown(growth, 3.0, 1.5, 0.05)
    assert growth == pytest.approx(0.7 * np.log(2.0))
    assert grown(0.0, 100.0, 1.0, 0.05) == pytest.approx(0.05 * 0.3)


def followed(resize):
    """Estimates (k, n) and their covariances of a spot that grows from 2 to 4 px, and the factor by which it has grown."""
    given = vedette.load(EXAMPLES / "flir_clip.toml", overrides=[f"estimator.resize={resize}"])
    tracker = given.tracker
    mean = np.array([[30.0, 40.0, 0.0, 0.0, 10.0, 8.0]])
    state, rows = tracker.start(Gaussian(mean, np.diag([1.0, 1.0, 1e4, 1e4, 0.0, 0.0])[None]), 0.0), []
    for k in range(100):
        pixels = frame(k, (30.0 + 0.5 * k, 40.0), 2.0 * 2.0 ** (min(k, 60) / 60))
        state = tracker.step(state, Scan.image(k / 30, "camera", Frame(pixels)))
        rows.append(tracker.estimate(state))
    return np.array([row.mean[0] for row in rows]), np.array([row.cov[0] for row in rows])


def test_the_box_follows_a_target_that_grows_and_states_its_doubt():
    mean, cov = followed(0.05)
    assert 1.4 < mean[-1, 4] / 10.0 < 2.1
    np.testing.assert_allclose(mean[:, 4] / mean[:, 5], 10.0 / 8.0)
    np.testing.assert_allclose(np.sqrt(cov[:, 4, 4]), DOUBT * mean[:, 4])
    assert np.abs(np.log(mean[-1, 4] / 20.0)) < 2.0 * DOUBT


@pytest.mark.costly
def test_places_are_the_same_with_and_without_a_size_that_follows():
    (with_size, cov), (without, plain) = followed(0.05), followed(0.0)
    np.testing.assert_array_equal(with_size[:, :4], without[:, :4])
    np.testing.assert_array_equal(cov[:, :4, :4], plain[:, :4, :4])
    np.testing.assert_array_equal(without[:, 4:], np.broadcast_to([10.0, 8.0], (100, 2)))
    assert not plain[:, 4:, 4:].any()


@pytest.mark.nightly("twenty segments: 10 s")
def test_labels_of_recorded_clips_lie_within_the_stated_doubt():
    """Of the sides of all labels .95 are within 1.96 standard deviations, as the doubt was chosen; the overlap is .78."""
    folder = recording("ir_clips")
    clips = [row.split(",")[0] for row in (folder / "segments.csv").read_text().split()[1:]]
    within, overlap = [], []
    for i, clip in enumerate(clips):
        overrides = [f"source.path={folder / clip}.mp4", f"source.segment={clips[:i].count(clip)}"]
        found = vedette.load(EXAMPLES / "flir_clip.toml", overrides=overrides).run()
        track, truth = found.tracks[0], found.recording.truth[0]
        kept = [(k, state) for k, time in enumerate(track.times) if (state := truth.at(float(time))) is not None]
        rows, true = [k for k, _ in kept], np.array([state for _, state in kept])
        sides, sigma = track.mean[rows, 4:6], np.sqrt(np.diagonal(track.cov[rows], axis1=1, axis2=2)[:, 4:6])
        within += (np.abs(true[:, 2:] - sides) < 1.96 * sigma).ravel().tolist()
        low = np.maximum(track.mean[rows, :2] - sides / 2, true[:, :2] - true[:, 2:] / 2)
        high = np.minimum(track.mean[rows, :2] + sides / 2, true[:, :2] + true[:, 2:] / 2)
        both = np.prod(np.maximum(high - low, 0.0), axis=1)
        overlap += (both / (sides.prod(axis=1) + true[:, 2:].prod(axis=1) - both)).tolist()
    assert 0.92 <= np.mean(within) <= 0.98
    assert np.mean(overlap) >= 0.78
