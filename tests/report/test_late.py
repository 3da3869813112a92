"""A sensor that sees all targets where they were, or beside it, is told; one that is noisier or slower is not."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

import vedette
from vedette_report.warnings.late import Shift, _told, late
from vedette_standard import Biased, CartesianPosition, RangeBearing

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
    return run(source, sensors, seed)


def run(source, sensors, seed, sigma_accel=0.1):
    """Return tracker, scans and tracks of a scene."""
    experiment = vedette.load(
        {
            "seed": seed,
            "source": source,
            "sensors": sensors,
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": sigma_accel}},
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
    (said,) = told(seed, other, offset={"x": 40.0, "y": -25.0}, lag=lag)
    length, deviation, x, y = map(float, re.search(r"(\S+) \+- (\S+) m .* x = (\S+), y = (\S+) \}", said).groups())
    assert said.startswith("other: its returns lie")
    assert (" earlier, and " in said and "lag = " in said) == (lag > 0)  # one cure, not two that each cure both
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
    (said,) = told(0, ships=1, lag=6.0)
    assert "beside those of one" in said
    assert float(re.search(r"lag = (\S+) or offset = ", said).group(1)) == pytest.approx(6.0, abs=1.5)


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.by_turns
def test_targets_of_one_velocity_tell_no_lag(seed):
    """What their tracks' velocities err by was taken for what they differ by: of two sensors without a fault 7 +- .9 s, and
    1,500 m, whose effects cancel.
    """
    sensor, legs = {**POSITION, "sigma": 20.0}, [{"do": "straight", "seconds": 300}]
    ships = {
        str(i): {"start": [-1500.0, 3000.0 * i], "course": "90 deg", "speed": 8.0 + 0.02 * i, "legs": legs} for i in range(4)
    }
    looks = {name: {"interval": dt, "jitter": 0.2} for name, dt in (("one", 4.0), ("other", 3.1))}
    source = {"kind": "simulation", "duration": 240.0, "ships": ships, "looks": looks}
    assert list(late(*run(source, {"one": sensor, "other": sensor}, seed, sigma_accel=1.0))) == []


@pytest.mark.costly
def test_tracks_of_clutter_tell_no_lag():
    """Of a hundred times the stated clutter, some thousand short tracks told .6 s: each lies along its own returns."""
    assert told(1, {**POSITION, "sigma": 8.0, "clutter_density": 1e-6}, clutter=1e-4) == []


def shifted(wrong, between=(2.0, 3.1, 2.3), seed=0):
    """Return the scene of `seen` where three sensors look, those of `wrong` displaced."""
    sensors = {"one": POSITION, "two": {**POLAR, "x": 3000.0}, "three": POLAR}
    drawn = {name: {"kind": "displaced", **off, "of": sensors[name]} for name, off in wrong.items()}
    ship = {"start": [-1500.0, 900.0], "course": "10 deg", "speed": 9.0, "legs": LEGS}
    ships = {"a": ship, "b": {**ship, "start": [1200.0, -1400.0], "course": "130 deg"}}
    looks = {name: {"interval": dt, "jitter": 0.2} for name, dt in zip(sensors, between, strict=True)}
    source = {"kind": "simulation", "duration": 240.0, "ships": ships, "looks": looks, "sensors": drawn}
    return run(source, sensors, seed)


@pytest.mark.costly
@pytest.mark.parametrize(
    ("wrong", "of"),
    [
        ({"one": {"offset": {"x": 70.0}}}, {"one": ("two", 70.0)}),  # by two against one, whatever each tells
        (
            {"two": {"offset": {"x": 70.0}}, "three": {"offset": {"x": -70.0}}},  # by what tells places itself
            {"two": ("one", 70.0), "three": ("one", -70.0)},
        ),
    ],
)
def test_each_sensor_is_held_against_the_same_one(wrong, of):
    """Each pair was told by itself: of three sensors one was to be moved to fit another that was to be moved, too."""
    found = list(late(*shifted(wrong)))
    assert {said.partition(":")[0] for said in found} == set(of)
    for said in found:
        first, x = of[said.partition(":")[0]]
        assert f"beside those of {first}" in said
        assert float(re.search(r"x = (\S+),", said).group(1)) == pytest.approx(x, abs=12.0)


@pytest.mark.parametrize(
    ("third", "cured"), [([-100.0, 100.0], '"displaced"'), ([-100.0, 160.0], "the tracks find it, `biased`")]
)
def test_offsets_that_no_place_makes_are_left_to_the_tracks(third, cured):
    """Of ranges that are off, each pair told another place; a number to state for each cured nothing."""
    pairs = {("ais", "a"): [100.0, 0.0], ("ais", "b"): [0.0, 100.0], ("a", "b"): third}
    deviations, errors = np.array([0.1, 5.0, 5.0]), np.array([1.0, 0.1])
    few = {pair: Shift(np.array([0.0, *at]), deviations, errors, np.ones(3)) for pair, at in pairs.items()}
    radar = RangeBearing(10.0, 0.005)
    sensors = {"a": radar, "b": radar, "ais": CartesianPosition(15.0)}
    knows = SimpleNamespace(sensors=sensors, registration=SimpleNamespace(offsets={}))
    found = list(_told(knows, ["a", "b", "ais"], few))
    assert [said.partition(":")[0] for said in found] == ["a", "b"]
    assert all("beside those of ais" in said and cured in said for said in found)


@pytest.mark.costly
def test_of_a_sensor_that_is_turned_no_offset_is_told():
    tracker, scans, tracks = seen(0, offset={"x": 40.0, "y": -25.0})
    assert list(late(tracker, scans, tracks, ["other"])) == []
