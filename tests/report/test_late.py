"""A sensor that sees all targets where they were, or beside it, is told; one that is noisier or slower is not."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import vedette
from vedette_report.warnings.late import late
from vedette_standard import Biased

POSITION = {"kind": "cartesian_position", "sigma": 15.0, "detection_probability": 0.9}
POLAR = {
    "kind": "range_bearing",
    "sigma_range": 10.0,
    "sigma_bearing": "0.3 deg",
    "x": -3000.0,
    "detection_probability": 0.9,
}
LEGS = [{"do": "straight", "seconds": 80}, {"do": "turn", "seconds": 60, "rate": "1 deg/s"}]


def seen(seed, other=POSITION, between=(2.0, 3.1), ships=3, clutter=0.0, **wrong):
    """Return tracker, scans and tracks of a scene of ships that two sensors see, one of them not as the tracker believes."""
    courses = ["10 deg", "130 deg", "250 deg"][:ships]
    starts = [[-1500.0, 900.0], [1200.0, -1400.0], [500.0, 1800.0]]
    sensors = {"one": {**POSITION, "sigma": 8.0}, "other": other}
    source = {
        "kind": "simulation",
        "duration": 240.0,
        "ships": {
            f"ship {i}": {"start": starts[i], "course": course, "speed": 7.0 + i, "legs": LEGS}
            for i, course in enumerate(courses)
        },
        "looks": {name: {"interval": dt, "jitter": 0.2} for name, dt in zip(sensors, between, strict=True)},
    }
    if clutter:
        box = {"low": -500.0, "high": 500.0}
        source["sensors"] = {name: {**sensor, "clutter_density": clutter} for name, sensor in sensors.items()}
        source["looks"] = {name: {**look, "clutter": {"x": box, "y": box}} for name, look in source["looks"].items()}
    source |= {"sensors": {"other": {"kind": "displaced", **wrong, "of": other}}} if wrong else {}
    experiment = vedette.load(
        {
            "seed": seed,
            "source": source,
            "sensors": sensors,
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "associator": {"kind": "jpda"},
            "birth": {"kind": "from_returns", "spread": {"vx": 8, "vy": 8}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    result = experiment.run()
    return experiment.tracker, result.scans, result.tracks


def told(*scene, **given):
    """Return what is said of a scene."""
    return list(late(*seen(*scene, **given)))


@pytest.mark.parametrize("other", [POSITION, POLAR], ids=lambda one: one["kind"])
@pytest.mark.parametrize("lag", [4.0, 8.0])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_turns
def test_a_lag_is_told_within_its_deviations(other, lag, seed):
    (said,) = told(seed, other, lag=lag)
    found, deviation = map(float, re.search(r"were ([\d.]+) \+- ([\d.]+) s earlier", said).groups())
    assert said.startswith("other: its returns lie where the targets of one were")
    assert abs(found - lag) < 4.0 * deviation + 0.05 < 1.5


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "scene",
    [
        {},
        {"other": POLAR},
        {"other": {**POSITION, "sigma": 60.0}},
        {"between": (2.0, 11.0)},
        {"ships": 1},
    ],
    ids=str,
)
@pytest.mark.by_turns
def test_nothing_is_told_where_no_sensor_is_late(scene, seed):
    assert told(seed, **scene) == []


@pytest.mark.parametrize("other", [POSITION, POLAR], ids=lambda one: one["kind"])
@pytest.mark.parametrize("lag", [0.0, 4.0])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.by_turns
def test_an_offset_is_told_within_its_deviations(other, lag, seed):
    said = told(seed, other, offset={"x": 40.0, "y": -25.0}, lag=lag)
    assert len(said) == 1 + (lag > 0)
    length, deviation, x, y = map(float, re.search(r"lie (\S+) \+- (\S+) m .* x = (\S+), y = (\S+) \}", said[-1]).groups())
    assert said[-1].startswith("other: its returns lie")
    assert np.hypot(x - 40.0, y + 25.0) < 4.0 * deviation + 0.5 < 12.0
    assert abs(length - np.hypot(x, y)) < 0.6


@pytest.mark.costly
def test_an_offset_that_tracks_find_themselves_is_not_told():
    """The returns still lie where they came from."""
    tracker, scans, tracks = seen(0, offset={"x": 40.0, "y": -25.0})
    for offsets, sentences in (({}, 1), ({"x_off": 60.0}, 0)):
        knows = SimpleNamespace(sensors=tracker.sensors, state=tracker.state, registration=SimpleNamespace(offsets=offsets))
        assert len(list(late(knows, scans, tracks))) == sentences


@pytest.mark.costly
def test_a_lag_that_tracks_find_themselves_is_not_told():
    """The example that does so was told to state it."""
    tracker, scans, tracks = seen(0, lag=4.0)
    for other, sentences in ((tracker.sensors["other"], 1), (Biased(tracker.sensors["other"], lag="late"), 0)):
        sensors = {**tracker.sensors, "other": other}
        knows = SimpleNamespace(sensors=sensors, state=tracker.state, registration=tracker.registration)
        assert len(list(late(knows, scans, tracks))) == sentences


def test_one_target_on_one_course_tells_no_lag_from_an_offset(monkeypatch):
    monkeypatch.setitem(globals(), "LEGS", [])
    assert told(0, ships=1, lag=6.0) == []


@pytest.mark.costly
def test_tracks_of_clutter_tell_no_lag():
    """Of a hundred times the stated clutter, some thousand short tracks told .6 s: each lies along its own returns."""
    assert told(1, {**POSITION, "sigma": 8.0, "clutter_density": 1e-6}, clutter=1e-4) == []
