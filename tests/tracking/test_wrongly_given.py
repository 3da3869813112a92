"""What a live loop hands over by mistake: an error at the door, in words, and the state before goes on."""

import datetime as dt

import numpy as np
import pytest

import vedette
from vedette import Detections, Gaussian, Pose, Scan, ScanRefused

PARTS = {
    "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}},
    "sensors": {
        "radar": {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9, "clutter_density": 1e-7}
    },
    "associator": {"kind": "jpda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}
EKF = {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.5}}
OTHERS = {
    "more axes": {
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_acceleration", "sigma_jerk": 0.5}},
        "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0, "ax": 1.0, "ay": 1.0}},
    },
    "modes": {"estimator": {"kind": "imm", "modes": [EKF, EKF], "transition": [[0.9, 0.1], [0.1, 0.9]]}},
    "lifecycle": {"lifecycle": {"kind": "existence"}},
}
Z = np.array([[1.0, 2.0], [500.0, 3.0]])


@pytest.fixture(scope="module")
def tracker():
    return vedette.build(PARTS)


@pytest.fixture(scope="module")
def state(tracker):
    return tracker.step(tracker.start(seed=1), Scan(0.0, "radar", Z))


def masked(z):
    return np.ma.array(z, mask=[[False, False], [True, False]])


@pytest.mark.parametrize(
    ("scan", "words"),
    [
        (lambda: Scan(1.0, ["radar"], Z), r"sensor: must be one of 'radar', got \['radar'\]"),
        (lambda: Scan(1e18, "radar", Z), r"time: must be a finite number.*got 1e\+18"),
        (lambda: Scan(1.0, "radar", 1e20 * Z), r"must be finite numbers.*got \[1e\+20"),
        (lambda: Scan(1.0, "radar", masked(Z)), r"return \[1\]: must be finite.*got \[nan, 3.0\]"),
        (
            lambda: Scan(1.0, "radar", Z, [0.0, 0.0]),
            r"pose: must be a vedette.Pose, as Pose\(\[x, y\]\) makes.*got \[0.0",
        ),
        (
            lambda: Scan(1.0, "radar", Z[None]),
            r"z: must have shape \(returns, 2\).*got \(1, 2, 2\)",
        ),
        (lambda: Scan(1.0, "radar", [], frame=np.zeros((3, 3))), "frame: 'radar' is not a camera"),
    ],
)
def test_a_scan_that_cannot_be_meant_is_refused_and_the_state_goes_on(tracker, state, scan, words):
    wanted = tracker.estimate(tracker.step(state, Scan(1.0, "radar", Z)))
    with pytest.raises(ScanRefused, match=words):
        tracker.step(state, scan())
    again = tracker.estimate(tracker.step(state, Scan(1.0, "radar", Z)))
    np.testing.assert_array_equal(again.mean, wanted.mean)
    np.testing.assert_array_equal(again.cov, wanted.cov)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: Scan(1.0, "radar", None), r"z: must be numbers.*got None"),
        (lambda: Detections.of(Z + 1j), r"z: must be numbers.*got array"),
        (lambda: Detections(Z, None), r"valid: must be true.*got None"),
        (lambda: Pose(None), r"position: must be 2 or 3 numbers.*got None"),
    ],
)
def test_what_is_no_detection_is_told_where_it_is_made(make, words):
    with pytest.raises(ValueError, match=words):
        make()


def test_what_is_masked_is_not_valid():
    seen = Detections(Z, np.ma.array([True, True], mask=[False, True]))
    assert seen.valid.tolist() == [True, False]


@pytest.mark.parametrize("no_state", [None, "state", Scan(1.0, "radar", Z)])
def test_what_is_no_state_is_told(tracker, no_state):
    with pytest.raises(TypeError, match=r"a state: must be the first.*`step`"):
        tracker.step(no_state, Scan(1.0, "radar", Z))
    with pytest.raises(TypeError, match="a state: must be the first"):
        tracker.estimate(no_state)


@pytest.mark.parametrize("name", OTHERS)
def test_a_state_of_another_tracker_is_told_and_no_part_is_blamed(state, name):
    other = vedette.build({**PARTS, **OTHERS[name]})
    with pytest.raises(
        ValueError, match=r"state: is one of another tracker: its (belief|memory) is of \w+.*, where this one"
    ):
        other.step(state, Scan(1.0, "radar", Z))


@pytest.mark.parametrize("time", [-1.0, np.nan, np.inf, "1", dt.datetime(2026, 1, 1)])
def test_there_is_no_estimate_before_the_state_nor_at_no_time(tracker, state, time):
    with pytest.raises((ValueError, TypeError), match=r"time: must be a number of s, not.*0.000000"):
        tracker.estimate(state, time)


@pytest.mark.parametrize("time", [np.nan, np.inf, "0", 1e18])
def test_a_tracker_starts_at_some_time(tracker, time):
    with pytest.raises(ValueError, match="time: must be a finite number of s"):
        tracker.start(time=time)


@pytest.mark.parametrize("seed", [-1, 1.5, "a"])
def test_a_seed_that_is_none_is_told(tracker, seed):
    with pytest.raises(ValueError, match="seed: must be a whole number >= 0"):
        tracker.start(seed=seed)


@pytest.mark.parametrize("cov", [-np.eye(4), np.full((4, 4), np.nan), np.eye(4) + np.triu(np.ones((4, 4)), 1)])
def test_a_prior_without_a_covariance_is_told(tracker, cov):
    with pytest.raises(ValueError, match=r"given: track \[1\] must have finite numbers"):
        tracker.start(Gaussian(np.zeros((2, 4)), np.stack([np.zeros((4, 4)), cov])))


def test_an_estimate_cannot_be_written_into_as_the_state_would_change(tracker, state):
    mean = tracker.estimate(state).mean
    with pytest.raises(ValueError, match="read-only"):
        mean += 1.0
    np.testing.assert_array_equal(tracker.estimate(state).mean[:, :2], Z)


def test_a_time_that_no_float_holds_is_refused():
    with pytest.raises(ValueError, match="time"):
        Scan(10**400, "radar", [[1.0, 2.0]])


def test_numbers_that_no_float_holds_are_refused():
    with pytest.raises(ValueError, match="time"):
        Scan(10**400, "radar", [[1.0, 2.0]])
    with pytest.raises(ValueError, match="z"):
        Detections.of([[10**400, 2.0]])
