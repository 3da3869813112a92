"""The truth between its recorded states: interpolated over short gaps, unknown in long ones."""

import numpy as np
import pytest

from vedette import Judge, Space, Trajectory
from vedette.metrics import judge
from vedette.metrics.histories import truth_at
from vedette.types import Detections, Scan, Track

PLANE = Space.of(x="m", y="m")
TIMES = np.array([0.0, 1.0, 2.0, 8.0, 9.0])
BOAT = Trajectory("boat", PLANE, TIMES, np.stack([10.0 * TIMES, np.zeros(5)], axis=-1))
LOOKS = np.array([-1.0, 0.0, 0.5, 2.0, 3.0, 5.0, 8.0, 8.5, 9.0, 9.5])


@pytest.mark.parametrize(
    ("most", "known"),
    [(None, [0, 1, 1, 1, 1, 1, 1, 1, 1, 0]), (6.0, [0, 1, 1, 1, 1, 1, 1, 1, 1, 0]), (1.0, [0, 1, 1, 1, 0, 0, 1, 1, 1, 0])],
)
def test_it_is_unknown_in_longer_gaps_but_for_their_ends(most, known):
    found = truth_at((BOAT,), LOOKS, None, most)
    np.testing.assert_array_equal(found.alive[:, 0], known)
    np.testing.assert_allclose(found.states[found.alive[:, 0], 0, 0], 10 * LOOKS[found.alive[:, 0]])


def test_scans_in_a_gap_count_for_nobody():
    """A track that runs on while nobody knows where the boat is, and is 100 m off there."""
    scans = tuple(Scan(time, "radar", Detections.of([], 2)) for time in np.arange(10.0).tolist())
    times = np.arange(10.0)
    mean = np.stack([10.0 * times, np.where((times > 2) & (times < 8), 100.0, 0.0)], axis=-1)
    ones = np.ones(10)
    track = Track(
        0, PLANE, times, mean, np.tile(np.eye(2), (10, 1, 1)), ones > 0, ones, None, (np.ones(1),) * 10, ones, ones
    )
    short, all_gaps = (judge((track,), (BOAT,), scans, Judge(truth_gap=most)) for most in (2.0, None))
    assert (short.scans, short.coverage, short.false_tracks, short.gospa_m) == (5, 1.0, 0.0, 0.0)
    assert (all_gaps.scans, all_gaps.coverage, all_gaps.false_tracks) == (10, 0.5, 0.5)


def follows(path, scans, number, apart=0.0):
    times = np.array([scan.time for scan in scans])
    mean = np.stack([path.at(time) for time in times.tolist()]) + [0.0, apart]
    ones = np.ones(len(times))
    cov = np.tile(np.eye(2), (len(times), 1, 1))
    return Track(number, PLANE, times, mean, cov, ones > 0, ones, None, (np.ones(1),) * len(times), ones, ones)


def test_a_gap_of_one_object_leaves_the_others_judged():
    """A boat that nobody sees from 2 to 8 s, beside one that is always seen; a third track follows nothing, far off."""
    scans = tuple(Scan(time, "radar", Detections.of([], 2)) for time in np.arange(10.0).tolist())
    other = Trajectory("other", PLANE, np.arange(10.0), np.stack([np.zeros(10), 500.0 + np.arange(10.0)], axis=-1))
    tracks = follows(BOAT, scans, 0, 60.0), follows(other, scans, 1, 3.0), follows(other, scans, 2, 900.0)
    score = judge(tracks, (BOAT, other), scans, Judge(truth_gap=2.0))
    assert score.scans == 10
    boat, seen = score.truths
    assert (boat.scans, boat.coverage) == (5, 0.0)
    assert (seen.scans, seen.coverage) == (10, 1.0)
    # the boat's own track, 60 m off, is false only in the 5 scans in which it is known where the boat is
    assert score.false_tracks == pytest.approx((10 + 5) / 10)


def test_in_a_gap_a_track_of_a_boat_that_is_hidden_may_cover_another_one():
    """It is nearer to where the hidden boat would be, and within the radius of the other, which it covers from then on."""
    scans = tuple(Scan(time, "radar", Detections.of([], 2)) for time in np.arange(10.0).tolist())
    beside = Trajectory("beside", PLANE, np.arange(10.0), np.stack([10.0 * np.arange(10.0), np.full(10, 30.0)], axis=-1))
    score = judge((follows(BOAT, scans, 0, 12.0),), (BOAT, beside), scans, Judge(truth_gap=2.0))
    assert [(one.scans, one.coverage) for one in score.truths] == [(5, 0.6), (10, 0.7)]
    assert score.false_tracks == 0.0
