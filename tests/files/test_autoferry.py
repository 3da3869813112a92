"""The Autoferry benchmark's files, odd forms included."""

import math

import numpy as np
import pytest

from support.autoferry import PLANE, SENSOR_IDS, Camera, entry, opened
from support.paths import recording
from vedette_files import AutoferrySource
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)


@pytest.mark.parametrize(
    ("measurement", "returns"),
    [
        ([], []),
        ([3.0, 4.0], [[13, 24]]),
        ([[3.0], [4.0]], [[13, 24]]),
        ([[3.0, 5.0], [4.0, 6.0]], [[13, 24], [15, 26]]),  # norths, then easts: not a list of positions
        ([[3.0, 5.0, 7.0], [4.0, 6.0, 8.0]], [[13, 24], [15, 26], [17, 28]]),
    ],
)
def test_positions_in_all_their_forms_become_absolute(tmp_path, measurement, returns):
    (scan,) = opened(tmp_path, [entry("radar", 1.0, measurement, ferry=(10.0, 20.0))]).scans
    assert scan.detections.z.tolist() == returns
    assert scan.detections.z.shape == (len(returns), 2)
    assert scan.pose.position.tolist() == [10, 20]


@pytest.mark.parametrize(("measurement", "bearings"), [([], []), (-2.5, [-2.5]), ([0.5, 4.0], [0.5, 4.0 - 2 * math.pi])])
def test_bearings_in_all_their_forms(tmp_path, measurement, bearings):
    for name in ("infrared", "electro_optical"):
        (scan,) = opened(tmp_path, [entry(name, 1.0, measurement)], sensors={name: Camera()}).scans
        np.testing.assert_allclose(scan.detections.z, np.array(bearings).reshape(-1, 1))


def test_a_polar_radar_gets_range_and_bearing_from_the_ferry(tmp_path):
    sensors = {"radar": RangeBearing(sigma_range=1.0, sigma_bearing=0.01)}
    (scan,) = opened(tmp_path, [entry("radar", 1.0, [3.0, -4.0], ferry=(10.0, 20.0))], sensors=sensors).scans
    np.testing.assert_allclose(scan.detections.z, [[5, math.atan2(-4, 3)]])
    np.testing.assert_allclose(sensors["radar"].at(scan.pose).measure(np.array([[13.0, 16.0]])), scan.detections.z)


def test_scans_are_sorted_by_corrected_times_and_ties_stay_as_they_stand(tmp_path):
    entries = [
        entry("radar", 10.0, [1.0, 1.0], ferry=(1.0, 0.0)),
        entry("lidar", 9.0, []),
        entry("infrared", 9.5, 0.1),
        entry("lidar", 8.0, []),
        entry("radar", 10.7, [2.0, 2.0], ferry=(2.0, 0.0)),
    ]
    sensors = {"lidar": PLANE["radar"], "radar": PLANE["radar"]}
    recording = opened(tmp_path, entries, sensors=sensors, lag={"radar": 2.0})
    assert [(scan.time, scan.sensor) for scan in recording.scans] == [
        (8.0, "radar"),
        (8.0, "lidar"),
        (8.7, "radar"),
        (9.0, "lidar"),
    ]
    assert recording.scans[2].pose.position.tolist() == [2, 0]  # the ferry's place at the stamp, whatever the lag


def test_only_the_sensors_that_are_asked_for(tmp_path):
    entries = [entry("radar", 1.0, []), entry("lidar", 1.0, []), entry("infrared", 1.0, [])]
    sensors = {"lidar": PLANE["radar"], "radar": PLANE["radar"], "infrared": Camera()}
    assert [scan.sensor for scan in opened(tmp_path, entries, sensors=sensors).scans] == ["radar", "lidar", "infrared"]
    chosen = AutoferrySource(scenario=7, path=str(tmp_path), sensors=["infrared"]).open(sensors, RNG)
    assert [scan.sensor for scan in chosen.scans] == ["infrared"]


def test_truth_counts_each_time_once_and_has_the_velocity(tmp_path):
    times = np.arange(0.0, 3.0, 0.25)
    states = {time: [5 + 2 * time, 7 - 3 * time, 0.0] for time in times.tolist()}
    boats = [[{"targetID": 2, "position": states[time], "time": time}] for time in [*times.tolist()[::-1], *times.tolist()]]
    boats[0].append({"targetID": 1, "position": [1.0, 1.0, 0.0], "time": 0.0})
    boats[1].append({"targetID": 1, "position": [1.0, 2.0, 0.0], "time": 4.0})
    recording = opened(tmp_path, [entry("radar", 1.0, [])], boats)
    one, two = recording.truth
    assert (one.name, two.name) == ("boat 1", "boat 2")
    assert two.times.tolist() == times.tolist()
    np.testing.assert_allclose(two.states[:, :2], [states[time][:2] for time in times.tolist()])
    np.testing.assert_allclose(two.states[:, 2:], np.tile([2.0, -3.0], (len(times), 1)), rtol=1e-12)
    np.testing.assert_allclose(one.states[:, 2:], [[0, 0.25]] * 2, rtol=1e-12)


def test_velocities_span_a_second_so_that_jitter_does_not_make_them(tmp_path):
    times = np.arange(0.0, 4.0, 0.1)
    jitter = np.where(np.arange(len(times)) // 2 % 2, 0.05, -0.05)
    boats = [[{"targetID": 1, "position": [3 * t + e, 0.0, 0.0], "time": t}] for t, e in zip(times, jitter, strict=True)]
    (boat,) = opened(tmp_path, [entry("radar", 1.0, [])], boats).truth
    assert np.abs(boat.states[5:-5, 2] - 3).max() <= 0.1 + 1e-9  # over one sample each way it would be 0.5 m/s


@pytest.fixture(scope="module")
def benchmark_folder():
    folder = recording("autoferry")
    return str(folder)


def misses(recording):
    """Distance in m from each boat to the nearest return, where one lies within 20 m."""
    found = []
    for scan in recording.scans:
        for boat in recording.truth:
            state = boat.at(scan.time)
            if state is not None and len(scan.detections.z):
                found.append(np.hypot(*(scan.detections.z - state[:2]).T).min())
    return np.array([miss for miss in found if miss < 20])


@pytest.mark.parametrize(
    ("scenario", "counts"),
    [(2, [234, 70, 1012, 591]), (5, [276, 83, 2197, 694]), (13, [232, 69, 1000, 584]), (16, [235, 72, 1014, 593])],
)
@pytest.mark.by_turns
def test_the_benchmark_is_read_whole(benchmark_folder, scenario, counts):
    sensors = {"lidar": PLANE["radar"], "radar": PLANE["radar"], "infrared": Camera(), "electro_optical": Camera()}
    recording = AutoferrySource(scenario=scenario, path=benchmark_folder).open(sensors, RNG)
    assert recording.refused == ()
    assert [sum(scan.sensor == name for scan in recording.scans) for name in SENSOR_IDS] == counts
    times = [scan.time for scan in recording.scans]
    assert times == sorted(times)
    assert [true.name for true in recording.truth] == ["boat 1", "boat 2"]
    assert all(np.all(np.diff(true.times) > 0) for true in recording.truth)
    assert all(np.hypot(*true.states[:, 2:].T).max() < 10 for true in recording.truth)


@pytest.mark.parametrize("scenario", [2, 5, 13, 16])
@pytest.mark.by_turns
def test_taking_off_one_antenna_turn_brings_the_radar_to_the_boats(benchmark_folder, scenario):
    as_stamped, corrected = (
        np.median(misses(AutoferrySource(scenario=scenario, path=benchmark_folder, lag={"radar": lag}).open(PLANE, RNG)))
        for lag in (0.0, 1.7)
    )
    assert corrected < 0.62 * as_stamped
