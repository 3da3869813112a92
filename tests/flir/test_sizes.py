"""The size that is reported: it follows a target that grows, says its doubt, and changes nothing of the tracking."""

import numpy as np
import pytest

import vedette
from support.infrared import steps
from support.paths import EXAMPLES, recording
from vedette import Frame, Gaussian, Scan
from vedette_flir.estimators import growth as growths
from vedette_flir.sizes import DOUBT, grown, larger_than, redrawn, spread_of


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


def liner(x, y, at, size):
    """The light of an airliner of so many px: a long body, and a brighter fin at its left end."""
    u, v = (x - at[0]) / size, (y - at[1]) / size
    return 120.0 * np.exp(-((u / 0.35) ** 2) - (v / 0.08) ** 2) + 120.0 * np.exp(
        -(((u + 0.3) / 0.1) ** 2) - ((v + 0.1) / 0.1) ** 2
    )


@pytest.mark.parametrize("grows", [-0.08, -0.03, 0.0, 0.03, 0.08])
def test_how_much_larger_a_thing_is_than_its_template_does_not_depend_on_shift_gain_or_level(grows):
    y, x = np.mgrid[:36, :36]
    mask = np.exp(-(((x - 17.5) / 14.0) ** 4) - ((y - 17.5) / 14.0) ** 4)
    plain = liner(x, y, (17.5, 17.5), 22.0) / 150.0
    shown = 0.2 + 1.1 * liner(x, y, (17.9, 17.2), 22.0 * np.exp(grows)) / 150.0
    larger, deviation = larger_than(plain, shown, mask)
    assert larger == pytest.approx(grows, abs=0.015)
    back, _ = larger_than(shown, plain, mask)
    assert back == pytest.approx(-grows, abs=0.015)
    noise = 0.1 * np.random.default_rng(3).normal(size=shown.shape)
    noisy, unsure = larger_than(plain, shown + noise, mask)
    assert unsure > deviation
    assert abs(noisy) < abs(larger) + 4.0 * unsure  # slopes of noise make it less


def test_a_template_is_drawn_anew_by_what_growth_and_the_frame_both_say():
    assert redrawn(90.0, 0.2, 0.08, 0.01) == pytest.approx(np.exp(0.08))
    assert redrawn(90.0, -0.07, -0.2, 0.01) == pytest.approx(np.exp(-0.07))
    assert redrawn(90.0, 0.2, -0.2, 0.01) == 1.0
    assert redrawn(90.0, 0.2, 0.08, 0.05) == 1.0
    assert redrawn(90.0, 0.2, 0.04, 0.001) == 1.0
    assert redrawn(9.0, 0.2, 0.08, 0.01) == 1.0  # less than a px of it


def airliner(growth, frames=60):
    """Places (k, 2), true ones, and widths over true ones of an airliner that grows before a wood; no spread is known."""
    y, x = np.mgrid[:256, :320]
    wood = 70.0 * (y > 152.0 + 4.0 * np.sin(x / 7.0) + 3.0 * np.sin(x / 2.3))
    sizes = 90.0 * np.exp(growth * np.arange(frames) / frames)
    places = np.stack([70.0 + 2.5 * np.arange(frames), np.full(frames, 142.0)], axis=1)
    shown = [
        60.0 + np.maximum(wood, liner(x, y, at, size)) + np.random.default_rng(k).normal(0.0, 1.0, x.shape)
        for k, (at, size) in enumerate(zip(places, sizes, strict=True))
    ]
    box = np.array([*places[0], 90.0, 40.0])
    assert np.isnan(spread_of(shown[0], box[:2], box[2:], 1.0))
    rows = np.array([estimate.mean[0] for _, estimate in steps(shown, [box])])
    return rows[:, :2], places, rows[:, 4] / sizes


@pytest.mark.parametrize("growth", [0.4, -0.4])
@pytest.mark.costly
def test_a_large_target_before_a_wood_is_followed_as_it_grows(growth, monkeypatch):
    found, true, ratio = airliner(growth)
    worst = np.hypot(*(found - true).T).max()
    assert worst < 7.0
    assert abs(np.log(ratio[-1])) < DOUBT
    monkeypatch.setattr(growths, "redrawn", lambda *_: 1.0)
    monkeypatch.setattr(growths, "grown_beside", lambda growth, *_: growth)
    found, _, ratio = airliner(growth)
    assert abs(np.log(ratio[-1])) > 0.35  # its box stays, and its place goes along with its fin
    assert np.hypot(*(found - true).T).max() > 1.8 * worst


@pytest.mark.parametrize("last", [0.5, 2.5])
def test_the_template_of_a_small_target_grows_and_never_shrinks_onto_its_core(last):
    spots = [frame(k, (30.0 + 0.5 * k, 40.0), 3.0 * last ** (min(k, 60) / 60)) for k in range(90)]
    sizes = [np.max(state.belief.appearance.size) for state, _ in steps(spots, [[30.0, 40.0, 15.0, 12.0]])]
    if last < 1.0:
        assert sizes[-1] == sizes[0]
    else:
        assert sizes[-1] > 1.3 * sizes[0]


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
