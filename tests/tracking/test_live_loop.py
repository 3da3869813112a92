"""What a user's hand gives a tracker, scan by scan: lists, empty lists, whole numbers; and what it cannot mean."""

import numpy as np
import pytest
from attrs import evolve, frozen

import vedette
from vedette import Detections, Gaussian, Pose, Recording, Scan, ScanRefused, Source
from vedette.experiment import Experiment

CONFIG = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}},
    "sensors": {
        "radar": {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": 0.01},
        "beacon": {"kind": "cartesian_position", "sigma": 5.0},
    },
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}
GIVEN = Gaussian(np.array([[1000.0, 0.0, 0.0, 0.0]]), 25.0 * np.eye(4)[None])


@pytest.fixture(scope="module")
def tracker():
    return vedette.build(CONFIG)


def after(tracker, scan, state=None):
    state = tracker.step(state or tracker.start(GIVEN, 0.0), scan)
    return tracker.estimate(state)


def same(one, other):
    np.testing.assert_array_equal(one.mean, other.mean)
    np.testing.assert_array_equal(one.cov, other.cov)


@pytest.mark.parametrize("sensor", CONFIG["sensors"])
def test_a_scan_without_returns_needs_no_number_of_axes(tracker, sensor):
    wanted = after(tracker, Scan(1.0, sensor, Detections.of([], 2)))
    for nothing in (Detections.of([]), Detections.of(np.zeros((0, 2))), [], ()):
        same(after(tracker, Scan(1.0, sensor, nothing)), wanted)


def test_lists_and_whole_numbers_are_taken(tracker):
    wanted = after(tracker, Scan(1.0, "beacon", Detections(np.array([[1003.0, 1.0]]), np.array([True]))))
    for seen in ([[1003, 1]], Detections.of([[1003, 1]]), Detections([[1003, 1]], [True]), np.array([[1003, 1]])):
        same(after(tracker, Scan(1, "beacon", seen)), wanted)


def test_a_pose_of_lists_is_one(tracker):
    z = Detections.of([[1000.0, 0.1]])
    wanted = after(tracker, Scan(1.0, "radar", z, Pose(np.zeros(2), np.zeros(2), 0.0)))
    same(after(tracker, Scan(1.0, "radar", z, Pose([0, 0], [0, 0], 0))), wanted)


def test_a_prior_of_lists_is_one(tracker):
    wanted = tracker.estimate(tracker.start(GIVEN))
    same(tracker.estimate(tracker.start(Gaussian(GIVEN.mean.tolist(), GIVEN.cov.tolist()))), wanted)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([1000.0, 0.0, 0.0, 0.0], r"given: must be vedette.Gaussian\(mean, cov\), got \[1000.0"),
        (Gaussian(np.zeros(4), np.eye(4)), r"given: must have mean \(..., tracks, 4\) .*got \(4,\) and \(4, 4\)"),
        (Gaussian(np.zeros((1, 2)), np.eye(2)[None]), r"given: must have mean \(..., tracks, 4\)"),
    ],
)
def test_a_prior_that_is_none_is_told(tracker, given, words):
    with pytest.raises(ValueError, match=words):
        tracker.start(given)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Detections.of([[1.0, 2.0], [3.0]]), "z: must be numbers in rows"),
        (lambda: Detections.of("far away"), "z: must be numbers"),
        (lambda: Scan("noon", "radar", []), "time: must be a number of s, got 'noon'"),
        (lambda: Scan(None, "radar", []), r"time: must be a number of s.*got None"),
        (lambda: Pose("here"), "position: must be numbers"),
    ],
)
def test_what_cannot_be_meant_is_told_where_it_enters(make, words):
    with pytest.raises(ValueError, match=words):
        make()


@pytest.mark.parametrize("position", [0.0, [1.0], [0.0] * 4])
def test_a_pose_that_is_no_place_is_refused(tracker, position):
    with pytest.raises(ScanRefused, match=r"pose.position: must be 2 or 3 numbers.*got shape"):
        after(tracker, Scan(1.0, "radar", [[1000.0, 0.1]], Pose(position)))


@frozen
class Quiet(Source):
    kind = "quiet"

    def open(self, sensors, rng):
        return Recording(tuple(Scan(float(t), "beacon", []) for t in range(5)))


def test_scans_of_empty_lists_are_recorded_over_the_sensor_s_axes(tracker):
    result = evolve(Experiment(tracker), source=Quiet()).run()
    assert [scan.detections.z.shape for scan in result.scans] == [(0, 2)] * 5
