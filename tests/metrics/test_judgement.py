"""Small scenes, judged by hand."""

import numpy as np
import pytest
from attrs import evolve
from hypothesis import given, settings
from hypothesis import strategies as st

from support.histories import BOAT, TEN, history, looks, path, still
from vedette.metrics import Judge, judge


def test_a_perfect_track():
    score = judge([history(7, TEN, still(TEN))], [BOAT], looks(TEN), Judge())
    zeros = (score.position_rmse_m, score.velocity_rmse_mps, score.gospa_m, score.gospa_all_m, score.ospa_m)
    assert zeros == (0, 0, 0, 0, 0)
    assert (score.coverage, score.id_switches, score.false_tracks, score.lost) == (1, 0, 0, 0)
    assert (score.scans, score.tracks, score.confirmed_after_s, score.nees_position) == (10, 1, 0, 0)


def test_errors_over_covered_scans_by_hand():
    xy = still(TEN, 3, 4)
    xy[6:] = [300, 400]
    cov = np.diag([4.0, 16.0, 1.0, 4.0])
    track = history(1, TEN, xy, v=(1, 2), cov=cov)
    score = judge([track], [BOAT], looks(TEN), Judge(cover_radius=10, lost_scans=4, gospa_cutoff=10))
    assert score.position_rmse_m == pytest.approx(5)
    assert score.velocity_rmse_mps == pytest.approx(np.sqrt(5))
    assert score.bias_m == pytest.approx((3, 4))
    assert score.nees_position == pytest.approx((9 / 4 + 16 / 16) / 2)
    assert score.nees_state == pytest.approx((9 / 4 + 16 / 16 + 1 + 1) / 4)
    assert score.nees_state_axes == ("x", "y", "vx", "vy")
    assert score.coverage == pytest.approx(0.6)
    assert score.lost == 1
    assert score.false_tracks == pytest.approx(0.4)
    assert score.gospa_m == pytest.approx((6 * 5 + 4 * 10) / 10)
    assert score.gospa_localisation == pytest.approx(6 * 25 / 10)
    assert score.gospa_missed == pytest.approx(score.gospa_false)
    assert score.gospa_missed == pytest.approx(4 * 50 / 10)
    assert score.ospa_m == pytest.approx((6 * 5 + 4 * 10) / 10)


def test_the_radius_of_a_loss_may_differ_from_that_of_coverage():
    track = history(1, TEN, still(TEN, 8))
    assert judge([track], [BOAT], looks(TEN), Judge(cover_radius=5)).lost == 1
    held = judge([track], [BOAT], looks(TEN), Judge(cover_radius=5, lost_error=9))
    assert (held.coverage, held.lost) == (0, 0)


def test_a_known_offset_is_removed():
    track = history(1, TEN, still(TEN, -4, 8))
    score = judge([track], [BOAT], looks(TEN), Judge(offset=[-4, 8], cover_radius=1))
    assert (score.coverage, score.position_rmse_m, score.gospa_m, score.nees_position) == (1, 0, 0, 0)
    assert np.array_equal(track.mean[:, :2], still(TEN, -4, 8))


def test_a_switch_is_counted_across_a_gap():
    first, second = history(1, TEN[:4], still(TEN[:4])), history(5, TEN[6:], still(TEN[6:]))
    score = judge([first, second], [BOAT], looks(TEN), Judge())
    assert (score.id_switches, score.coverage, score.lost, score.tracks) == (1, 0.8, 0, 2)


def test_false_tracks_and_far_ones():
    """One good track, one beside it on the same boat, one near, one far; one tentative that never counts."""
    tracks = [
        history(0, TEN, still(TEN)),
        history(1, TEN, still(TEN, 2)),
        history(2, TEN[:5], still(TEN[:5], 60)),
        history(3, TEN, still(TEN, 500)),
        history(4, TEN, still(TEN), confirmed=np.zeros(10)),
    ]
    near = judge(tracks, [BOAT], looks(TEN), Judge(cover_radius=10, near=100, far=100, gospa_cutoff=20))
    every = judge(tracks, [BOAT], looks(TEN), Judge(cover_radius=10, gospa_cutoff=20))
    assert near.false_tracks == pytest.approx(1.5)
    assert every.false_tracks == pytest.approx(2.5)
    assert near.tracks == 4
    assert near.gospa_m == pytest.approx((20 + np.sqrt(200)) / 2)
    assert near.gospa_all_m == pytest.approx((np.sqrt(600) + 20) / 2)
    assert every.gospa_m == every.gospa_all_m == pytest.approx(near.gospa_all_m)
    assert near.gospa_false == pytest.approx(1.5 * 200)


def test_only_confirmed_scans_count_and_the_wait_is_told():
    track = history(1, TEN, still(TEN), confirmed=TEN >= 3)
    score = judge([track], [BOAT], looks(TEN), Judge(lost_scans=2))
    assert score.coverage == pytest.approx(0.7)
    assert (score.confirmed_after_s, score.lost) == (3, 0)


def test_figures_per_truth_and_their_means():
    other = path("other", TEN[5:], still(TEN[5:], 100))
    tracks = [history(1, TEN, still(TEN, 1)), history(2, TEN[8:], still(TEN[8:], 103))]
    score = judge(tracks, [BOAT, other, path("never", [50.0, 60.0], still([0, 0]))], looks(TEN), Judge(lost_scans=3))
    boat, late, never = score.truths
    assert (boat.name, boat.scans, boat.coverage, boat.position_rmse_m, boat.lost) == ("boat", 10, 1, 1, False)
    assert (late.scans, late.coverage, late.position_rmse_m, late.confirmed_after_s) == (5, 0.4, 3, 3)
    assert (never.scans, never.coverage, never.lost, never.position_rmse_m) == (0, None, None, None)
    assert score.coverage == pytest.approx(0.7)
    assert score.confirmed_after_s == pytest.approx(1.5)
    assert score.position_rmse_m == pytest.approx(np.sqrt((10 * 1 + 2 * 9) / 12))


def test_an_object_that_is_not_there_is_neither_missed_nor_near():
    short = path("short", TEN[2:5], still(TEN[2:5]))
    score = judge(
        [history(1, TEN, still(TEN))], [short, path("far", TEN, still(TEN, 900))], looks(TEN), Judge(near=50, far=50)
    )
    assert score.truths[0].scans == 3
    assert score.truths[0].coverage == 1
    assert score.false_tracks == 0
    assert score.gospa_m == pytest.approx(50 / np.sqrt(2))
    assert score.gospa_all_m == pytest.approx((3 * 50 / np.sqrt(2) + 7 * 50) / 10)


def test_scans_without_any_truth_recorded_are_not_judged():
    """Before the first and after the last; a gap within counts as an empty scene."""
    parts = [path("a", TEN[2:4], still(TEN[2:4])), path("b", TEN[6:8], still(TEN[6:8]))]
    score = judge([history(1, TEN, still(TEN))], parts, looks(TEN), Judge())
    assert score.scans == 6
    assert score.false_tracks == pytest.approx(2 / 6)
    assert score.gospa_false == pytest.approx(2 / 6 * 50**2 / 2)


def test_a_window_of_one_sensors_scans():
    """Lidar scans lie between the radar's and at their times; after the radar the track is right, after the lidar wrong."""
    scans = sorted(looks(TEN) + looks(np.arange(0.0, 10.0, 0.5), "lidar"), key=lambda scan: scan.time)
    times = np.array([scan.time for scan in scans])
    xy = np.array([[0.0 if scan.sensor == "radar" else 30.0, 0.0] for scan in scans])
    track = history(1, times, xy)
    radar = judge([track], [BOAT], scans, Judge(sensor="radar", first_scan=2, last_scan=6))
    lidar = judge([track], [BOAT], scans, Judge(sensor="lidar"))
    assert (radar.scans, radar.position_rmse_m) == (5, 0)
    assert (lidar.scans, lidar.position_rmse_m) == (19, pytest.approx(30))


def test_tracks_that_start_or_end_between_scans_of_one_time():
    """Three scans at each time. The first track starts at the last scan of time 1; the other ends at the first of it."""
    times = np.repeat([0.0, 1.0, 2.0], 3)
    late = history(1, times[5:], still(times[5:]))
    early = history(2, times[:4], still(times[:4]))
    truth = [path("boat", [0.0, 2.0], still([0, 2]))]
    assert judge([late], truth, looks(times), Judge(first_scan=4, last_scan=4)).coverage == 0
    assert judge([late], truth, looks(times), Judge(first_scan=5)).coverage == 1
    assert judge([early], truth, looks(times), Judge(last_scan=3)).coverage == 1
    assert judge([early], truth, looks(times), Judge(first_scan=4)).coverage == 0


def test_nis_by_hand():
    """Starts (NIS 0) and tentative scans are left out; axes are those of each scan; the gate's share is allowed for."""
    scans = looks(TEN[:2]) + looks(TEN[2:4], "camera", axes=1)
    track = history(1, TEN[:4], still(TEN[:4]), nis=[0.0, 3.0, 0.5, 2.0], hit=[1.0, 1.0, 0.5, 1.0])
    tentative = evolve(track, confirmed=np.array([True, False, False, False]))
    assert judge([track], [], scans, Judge()).nis == pytest.approx(5.5 / 3.5)
    assert judge([track], [], scans, Judge(sensor="camera")).nis == pytest.approx(2.5 / 1.5)
    assert judge([tentative], [], scans, Judge()).nis is None
    assert judge([track], [], scans, Judge(sensor="radar"), 0.9).nis > 3.0 / 2.0


def test_mode_probabilities_over_covered_scans():
    modes = np.array([[0.9, 0.1]] * 5 + [[0.5, 0.5]] * 5)
    xy = still(TEN)
    xy[5:] = 1e4
    score = judge([history(1, TEN, xy, mode_prob=modes)], [BOAT], looks(TEN), Judge())
    assert score.mode_prob == pytest.approx((0.9, 0.1))


@pytest.mark.costly
@given(st.permutations(range(3)), st.permutations(range(2)), st.integers(0, 2**32 - 1).map(np.random.default_rng))
@settings(max_examples=40)
def test_the_order_of_tracks_and_truths_and_the_origin_change_nothing(order, names, rng):
    truth = [path(f"t{i}", TEN, np.cumsum(rng.normal(size=(10, 2)), axis=0) + np.array([4.0 * i, 0.0])) for i in range(2)]
    tracks = []
    for i in range(3):
        begin, end = sorted(rng.choice(11, 2, replace=False))
        xy = truth[i % 2].states[begin:end, :2] + rng.normal(size=(end - begin, 2))
        tracks.append(history(i, TEN[begin:end], xy, nis=rng.uniform(size=end - begin)))
    options = Judge(cover_radius=3, gospa_cutoff=4, near=5, far=5, lost_error=2)
    score = judge(tracks, truth, looks(TEN), options)
    shuffled = judge([tracks[i] for i in order], [truth[i] for i in names], looks(TEN), options)
    move = np.array([64.0, -32.0, 0.0, 0.0])
    moved = judge(
        [evolve(track, mean=track.mean + move) for track in tracks],
        [evolve(trajectory, states=trajectory.states + move) for trajectory in truth],
        looks(TEN),
        options,
    )
    for other in (shuffled, moved):
        for name in (
            "position_rmse_m",
            "coverage",
            "id_switches",
            "false_tracks",
            "lost",
            "gospa_m",
            "gospa_all_m",
            "nees_position",
            "nis",
        ):
            assert getattr(other, name) == pytest.approx(getattr(score, name), rel=1e-9), name
