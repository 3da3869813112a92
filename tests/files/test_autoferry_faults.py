"""What each fault of the Autoferry benchmark's files costs."""

import json
import math

import numpy as np
import pytest

from support.autoferry import BOATS, PLANE, Camera, entry, opened, told
from vedette.errors import ConfigError, InputError
from vedette_files import AutoferrySource

RNG = np.random.default_rng(0)
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
        "scenario7_groundTruth.json[0][2]: boat 1 has another position at 1.0 s in an earlier entry",
        "scenario7_groundTruth.json[0][3]: position must be a list of 3 numbers, got [0.0, 0.0]",
        'scenario7_groundTruth.json[0][5]: must be an object with targetID, position and time, got "boat"',
        "scenario7_groundTruth.json: boat 3 has a position at one time only, which gives no velocity",
    ]


WHOLE = json.dumps([entry("radar", 1.0, [])])
BAD_FILES = {
    "truncated": (WHOLE[:-20], "scenario7_detections.json: is not JSON, or cut short, at column"),
    "empty": (" \n", "scenario7_detections.json: is empty. Wanted: the Autoferry sensor fusion benchmark"),
    "no list": ("{}", "scenario7_detections.json: must be a list, got {}"),
    "too deep": ("[" * 200_000, "scenario7_detections.json: is nested deeper than 32 levels"),
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
    with pytest.raises(InputError, match=r"scenario7_groundTruth\.json: is not JSON, or cut short.*3"):
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
    with pytest.raises(ValueError, match=r"sensors: must be of lidar.*got 'sonar'"):
        AutoferrySource(scenario=2, sensors=["sonar"])
    with pytest.raises(ValueError, match=r"lag\.sonar: must be of lidar"):
        AutoferrySource(scenario=2, lag={"sonar": 1})
    with pytest.raises(ValueError, match="scenario: must be >= 1"):
        AutoferrySource(scenario=0)


def test_without_the_recording_the_error_says_what_it_is(tmp_path):
    for path, error in (("", ConfigError), (str(tmp_path / "none"), ConfigError), (str(tmp_path), InputError)):
        with pytest.raises(error, match=r"Wanted: the Autoferry sensor .*111152\).*scenarioN_detections\.json"):
            AutoferrySource(scenario=2, path=path).open(PLANE, RNG)
