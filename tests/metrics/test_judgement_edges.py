"""Figures that do not exist, and input that is wrong."""

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support.histories import BOAT, TEN, history, looks, path, still
from vedette import InputError, Space, Trajectory
from vedette.metrics import Judge, judge
from vedette.metrics.histories import truth_at

law = settings(max_examples=150)


# Where a figure does not exist
@pytest.mark.parametrize("truth", [[], [BOAT], [path("later", [99.0, 100.0], still([0, 1]))]], ids=["none", "boat", "later"])
@pytest.mark.parametrize("tracks", [[], [history(1, TEN, still(TEN))], [history(1, TEN, still(TEN), confirmed=TEN < 0)]])
@pytest.mark.parametrize("options", [Judge(), Judge(sensor="nobody"), Judge(first_scan=99), Judge(far=1, near=1)])
def test_what_does_not_exist_is_none_and_json_takes_the_rest(tracks, truth, options):
    score = judge(tracks, truth, looks(TEN), options)
    figures = json.loads(json.dumps(score.figures(), allow_nan=False))
    assert figures["tracks"] == sum(bool(track.confirmed.any()) for track in tracks)
    judged = bool(truth) and truth[0] is BOAT and options.sensor is None and options.first_scan == 0
    for name in ("coverage", "lost", "gospa_m", "gospa_all_m", "ospa_m", "false_tracks", "id_switches"):
        assert (figures[name] is not None) == judged
    for name in ("position_rmse_m", "velocity_rmse_mps", "bias_m", "nees_position", "nees_state"):
        assert (figures[name] is not None) == (judged and figures["tracks"] == 1)


def test_no_scans_no_tracks():
    for truth in ([], [BOAT], [path("nothing", [], np.zeros((0, 2)))]):
        score = judge([], truth, [], Judge())
        assert (score.scans, score.tracks, score.coverage, score.gospa_m) == (0, 0, None, None)


def test_no_track_at_all_misses_every_truth():
    score = judge([], [BOAT], looks(TEN), Judge(gospa_cutoff=10))
    assert (score.coverage, score.lost, score.false_tracks, score.id_switches) == (0, 1, 0, 0)
    assert score.gospa_m == pytest.approx(10 / np.sqrt(2))


def test_a_singular_covariance_has_no_nees():
    cov = np.eye(4)
    cov[2:, 2:] = 1.0
    score = judge([history(1, TEN, still(TEN), cov=cov)], [BOAT], looks(TEN), Judge())
    assert (score.nees_position, score.nees_state) == (0, None)


def test_a_truth_of_positions_alone_gives_no_velocity_error():
    bare = Trajectory("boat", Space.of(x="m", y="m", z="m"), TEN, np.zeros((10, 3)))
    score = judge([history(1, TEN, still(TEN, 3))], [bare], looks(TEN), Judge())
    assert (score.position_rmse_m, score.velocity_rmse_mps, score.nees_state_axes) == (3, None, ("x", "y"))


# Input that is wrong
def test_truth_without_a_shared_position_is_refused():
    with pytest.raises(InputError, match=r"^truth 'boat': must have a position axis x, y or z"):
        judge(
            [history(1, TEN, still(TEN))],
            [Trajectory("boat", Space.of(range="m"), TEN, np.zeros((10, 1)))],
            looks(TEN),
            Judge(),
        )


def test_truth_in_another_unit_is_refused():
    pixels = Trajectory("bird", Space.of(x="px", y="px"), TEN, np.zeros((10, 2)))
    with pytest.raises(InputError, match=r"^truth 'bird': axis x \[px\] is x \[m\] elsewhere"):
        judge([history(1, TEN, still(TEN))], [pixels], looks(TEN), Judge())


def test_a_track_at_a_time_without_a_scan_is_refused():
    with pytest.raises(InputError, match=r"^tracks: track 3 has an entry at 4.500000 s"):
        judge([history(3, [4.0, 4.5], still([4, 4.5]))], [BOAT], looks(TEN), Judge())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"cover_radius": 0}, r"^cover_radius: must be > 0, got 0 m"),
        ({"gospa_order": 0.5}, r"^gospa_order: must be >= 1 and <= 10, got 0.5"),
        ({"offset": [1.0]}, r"^offset: must be \[x, y\], got 1 numbers"),
        ({"far": -1}, r"^far: must be > 0, got -1 m"),
        ({"first_scan": 5, "last_scan": 3}, r"^last_scan: must be >= first_scan \(5\), got 3"),
        ({"lost_scans": 2.5}, r"^lost_scans: must be a whole number, got 2.5"),
    ],
)
def test_a_judge_that_cannot_be_is_refused(options, message):
    with pytest.raises(ValueError, match=message):
        Judge(**options)


# Truth at scans
@given(
    st.lists(st.floats(0, 10), min_size=1, max_size=6, unique=True).map(sorted),
    st.lists(st.floats(-1, 11), max_size=8).map(sorted),
    st.integers(0, 2**32 - 1).map(np.random.default_rng),
)
@law
@pytest.mark.costly
def test_truth_at_all_scans_is_truth_at_each(known, times, rng):
    space = Space.of(heading="rad mod 2pi", x="m")
    trajectory = Trajectory("boat", space, np.array(known), rng.uniform(-3, 3, size=(len(known), 2)))
    times = np.array([*times, *known])
    real = truth_at([trajectory], times, None)
    for i, time in enumerate(times):
        expected = trajectory.at(float(time))
        assert real.alive[i, 0] == (expected is not None)
        if expected is not None:
            assert np.allclose(space.difference(real.states[i, 0], expected), 0, atol=1e-9)
