"""The Autoferry benchmark's files, odd forms included, and what each fault costs."""

import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from attrs import frozen

from vedette import Sensor, Space
from vedette.errors import ConfigError, InputError
from vedette.io import AutoferrySource
from vedette_standard.sensors.cartesian_position import CartesianPosition
from vedette_standard.sensors.range_bearing import RangeBearing

RNG = np.random.default_rng(0)
PLANE = {"radar": CartesianPosition(sigma=1.0)}
SENSOR_IDS = {"lidar": 1, "radar": 2, "infrared": 3, "electro_optical": 4}
BOATS = [
    [{"targetID": 1, "position": [0.0, 0.0, 0.0], "time": 0.0}, {"targetID": 1, "position": [2.0, 0.0, 0.0], "time": 1.0}]
]


@frozen
class Camera(Sensor):
    """Measures the bearing; the tests only read for it."""

    @property
    def observes(self):
        return Space.of(x="m", y="m")

    @property
    def measurement(self):
        return Space.of(bearing="rad mod 2pi")

    def measure(self, x):
        return np.arctan2(x[..., 1:], x[..., :1])

    def noise(self, x):
        return np.eye(1)

    def detects(self, x):
        return np.ones(())

    def clutter(self, z):
        return np.zeros(())


def entry(sensor, time, measurement, ferry=(0.0, 0.0)):
    return {
        "sensorID": SENSOR_IDS[sensor],
        "measurements": [],
        "ownshipPosition": list(ferry),
        "time": time,
        "measurement": measurement,
    }


def opened(folder, entries, boats=BOATS, sensors=PLANE, **options):
    for part, content in (("detections", entries), ("groundTruth", boats)):
        text = content if isinstance(content, str) else json.dumps(content)
        (folder / f"scenario7_{part}.json").write_text(text)
    return AutoferrySource(scenario=7, path=str(folder), **options).open(sensors, RNG)


def told(recording):
    return [str(problem) for problem in recording.refused]


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


BAD_ENTRIES = {
    "no object": (5, "must be an object, got 5"),
    "no sensor": ({}, "sensorID must be one of 1, 2, 3, 4, got null"),
    "sensor that is a list": (entry("radar", 1.0, []) | {"sensorID": [2]}, "sensorID must be one of"),
    "time that is text": (entry("radar", "1.0", []), 'time must be a finite number of at most 1e+15, got "1.0"'),
    "no ferry": (entry("radar", 1.0, [], ferry=()), "ownshipPosition must be a list of 2 numbers, got []"),
    "ferry NaN": (entry("radar", 1.0, [], ferry=(0.0, math.nan)), "ownshipPosition[1] must be a finite number"),
    "three numbers": (entry("radar", 1.0, [1.0, 2.0, 3.0]), "measurement must be [], [n, e] or [[n, n, ...], [e, e, ...]]"),
    "rows of unlike length": (entry("radar", 1.0, [[1.0, 2.0], [3.0]]), "measurement must be [], [n, e] or"),
    "a row and a number": (entry("radar", 1.0, [[1.0], 3.0]), "measurement must be [], [n, e] or"),
}


@pytest.mark.parametrize(("bad", "text"), BAD_ENTRIES.values(), ids=BAD_ENTRIES)
def test_a_bad_entry_is_refused_by_itself(tmp_path, bad, text):
    recording = opened(tmp_path, [entry("radar", 0.0, []), bad, entry("radar", 2.0, [])])
    assert [scan.time for scan in recording.scans] == [0, 2]
    (problem,) = recording.refused
    assert problem.place == "scenario7_detections.json[1]"
    assert problem.text.startswith(text)


def test_a_bad_return_is_refused_by_itself_and_with_the_last_its_scan(tmp_path):
    entries = [
        entry("radar", 0.0, [[1.0, math.nan, 3.0], [1.0, 2.0, True]]),
        entry("radar", 1.0, ["far", 2.0]),
        entry("infrared", 2.0, [1.0, None]),
    ]
    recording = opened(tmp_path, entries, sensors=PLANE | {"infrared": Camera()})
    assert [scan.detections.z.tolist() for scan in recording.scans] == [[[1, 1]], [[1]]]
    number = "each of its numbers must be a finite number of at most 1e+15, got"
    assert told(recording) == [
        f"scenario7_detections.json[0], return 1: {number} NaN",
        f"scenario7_detections.json[0], return 2: {number} true",
        f'scenario7_detections.json[1], return 0: {number} "far"',
        f"scenario7_detections.json[2], return 1: {number} null",
    ]


def test_bad_truth_is_refused_by_itself(tmp_path):
    boats = [
        [
            *BOATS[0],
            {"targetID": 1, "position": [9.0, 9.0, 0.0], "time": 1.0},
            {"targetID": 1, "position": [0.0, 0.0], "time": 2.0},
            {"targetID": 3, "position": [0.0, 0.0, 0.0], "time": 2.0},
            "boat",
        ]
    ]
    recording = opened(tmp_path, [entry("radar", 1.0, [])], boats)
    (boat,) = recording.truth
    assert boat.states.tolist() == [[0, 0, 2, 0], [2, 0, 2, 0]]
    assert told(recording) == [
        "scenario7_groundTruth.json[0][2]: boat 1 is elsewhere at 1.0 s in an earlier entry",
        "scenario7_groundTruth.json[0][3]: position must be a list of 3 numbers, got [0.0, 0.0]",
        'scenario7_groundTruth.json[0][5]: must be an object with targetID, position and time, got "boat"',
        "scenario7_groundTruth.json: boat 3 has a position at one time only, which gives no velocity",
    ]


WHOLE = json.dumps([entry("radar", 1.0, [])])
BAD_FILES = {
    "truncated": (WHOLE[:-20], "scenario7_detections.json: is not JSON, or cut short, at column"),
    "empty": (" \n", "scenario7_detections.json: is empty. Wanted: the Autoferry sensor fusion benchmark"),
    "no list": ("{}", "scenario7_detections.json: must be a list, got {}"),
    "too deep": ("[" * 200_000, "scenario7_detections.json: is not JSON that can be read"),
    "absurdly long number": ("[" + "1" * 5000 + "]", "scenario7_detections.json: is not JSON that can be read"),
    "no scan": ("[]", "scenario7_detections.json: holds no usable scan of radar"),
    "only bad scans": ("[1]", "the first problem: scenario7_detections.json[0]: must be an object, got 1"),
}


@pytest.mark.parametrize(("content", "text"), BAD_FILES.values(), ids=BAD_FILES)
def test_a_file_that_is_no_good_as_a_whole(tmp_path, content, text):
    with pytest.raises(InputError) as caught:
        opened(tmp_path, content)
    assert text in str(caught.value)


def test_truncated_truth(tmp_path):
    with pytest.raises(InputError, match=r"scenario7_groundTruth\.json: is not JSON, or cut short, at line 2, column 3"):
        opened(tmp_path, WHOLE, "[\n{ ")


BAD_OPTIONS = {
    "sensor that the tracker lacks": (
        {"chosen": ["lidar"]},
        "sensors: the tracker has no sensor 'lidar', only 'radar'",
    ),
    "no sensor in common": (
        {"sensors": {"sonar": PLANE["radar"]}},
        "sensors: the recording has 'lidar', 'radar', 'infrared', 'electro_optical', the tracker 'sonar'",
    ),
    "sensor that measures something else": (
        {"sensors": {"infrared": PLANE["radar"]}},
        "sensors.infrared: must measure axes of (bearing [rad mod 6.28319]), measures (x [m], y [m])",
    ),
}


@pytest.mark.parametrize(("given", "text"), BAD_OPTIONS.values(), ids=BAD_OPTIONS)
def test_sensors_that_do_not_fit(tmp_path, given, text):
    opened(tmp_path, WHOLE)
    source = AutoferrySource(scenario=7, path=str(tmp_path), sensors=given.get("chosen"))
    with pytest.raises(ConfigError) as caught:
        source.open(given.get("sensors", PLANE), RNG)
    assert text in str(caught.value)


def test_parameters():
    with pytest.raises(ValueError, match="sensors: must be of lidar, radar, infrared, electro_optical, got 'sonar'"):
        AutoferrySource(scenario=2, sensors=["sonar"])
    with pytest.raises(ValueError, match=r"lag\.sonar: must be of lidar"):
        AutoferrySource(scenario=2, lag={"sonar": 1})
    with pytest.raises(ValueError, match="scenario: must be >= 1"):
        AutoferrySource(scenario=0)


def test_without_the_recording_the_error_says_what_it_is(tmp_path):
    for path, error in (("", ConfigError), (str(tmp_path / "none"), ConfigError), (str(tmp_path), InputError)):
        with pytest.raises(error, match=r"Wanted: the Autoferry sensor .*111152\).*scenarioN_detections\.json"):
            AutoferrySource(scenario=2, path=path).open(PLANE, RNG)


@pytest.fixture(scope="module")
def benchmark_folder():
    folder = Path(os.environ.get("VEDETTE_DATA", "")) / "autoferry"
    if "VEDETTE_DATA" not in os.environ or not folder.is_dir():
        pytest.skip("VEDETTE_DATA names no folder with the Autoferry benchmark")
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
def test_taking_off_one_antenna_turn_brings_the_radar_to_the_boats(benchmark_folder, scenario):
    as_stamped, corrected = (
        np.median(misses(AutoferrySource(scenario=scenario, path=benchmark_folder, lag={"radar": lag}).open(PLANE, RNG)))
        for lag in (0.0, 1.7)
    )
    assert corrected < 0.62 * as_stamped
