"""A radar whose bearings are turned is told of, by truth or by reports with names; one that is right is not."""

import re

import attrs
import numpy as np
import pytest

import vedette
from vedette import Detections, Pose, Scan, Space, Trajectory
from vedette_report.warnings import turned as room
from vedette_report.warnings.turned import turned

RADAR = {"kind": "range_bearing", "sigma_range": 10.0, "sigma_bearing": "0.5 deg", "max_range": 8000.0}
IN_PLANE, SHIP = {**RADAR, "kind": "polar_position"}, np.array([900.0, -400.0])


def scene(seed, *, off, vessels=4, clutter=10, reports=(0, 1), by_truth=False, plane=False, beside=(0.0, 0.0), late=0.0):
    """What is told of scans of a radar that is turned, and of some vessels' reports; its returns are `beside`, and late."""
    rng = np.random.default_rng(seed)
    tracker = vedette.build(
        {
            "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {"radar": IN_PLANE if plane else RADAR, "ais": {"kind": "cartesian_position", "sigma": 5.0}},
            "associator": {"kind": "jpda"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
            "lifecycle": {"kind": "existence"},
        }
    )
    x, v = rng.uniform(-3000, 3000, (vessels, 2)), rng.uniform(-6, 6, (vessels, 2))
    scans = []
    for k in range(100):
        at = x + 2.5 * k * v - SHIP * plane
        seen = at + beside - late * v
        z = np.stack([np.hypot(*seen.T), np.arctan2(seen[:, 1], seen[:, 0]) + off], axis=1)
        z = (z + rng.normal(0, 1, z.shape) * [10.0, np.radians(0.5)])[rng.random(vessels) < 0.8]
        false = np.stack([rng.uniform(0, 8000, clutter), rng.uniform(-np.pi, np.pi, clutter)], axis=1)
        r, b = np.concatenate([z, false]).T
        seen = SHIP + np.stack([r * np.cos(b), r * np.sin(b)], axis=1) if plane else np.stack([r, b], axis=1)
        scans.append(Scan(2.5 * k, "radar", Detections.of(seen, 2), Pose(SHIP) if plane else None))
        if k % 4 == 0 and reports:
            seen = (at + SHIP * plane)[list(reports)] + rng.normal(0, 5, (len(reports), 2))
            named = attrs.evolve(Detections.of(seen, 2), identity=np.array(reports))
            scans.append(Scan(2.5 * k + 0.1, "ais", named))
    times = 2.5 * np.arange(100)
    truth = [Trajectory(str(i), Space.of(x="m", y="m"), times, x[i] + times[:, None] * v[i]) for i in range(vessels)]
    return list(map(str, turned(tracker, scans, truth if by_truth else [])))


def angle(told):
    return float(re.search(r"lie ([+-][\d.]+) ", told)[1])


@pytest.mark.parametrize("degrees", [3.0, -2.5, 1.0])
@pytest.mark.parametrize("by_truth", [True, False])
@pytest.mark.by_turns
def test_an_antenna_that_is_turned_is_told_of_with_its_angle(degrees, by_truth):
    for seed in range(4):
        (told,) = scene(seed, off=np.radians(degrees), by_truth=by_truth, reports=() if by_truth else (0, 1))
        assert abs(angle(told) - degrees) < 0.2
        assert told.startswith("radar:")
        assert ("[registration]" in told) == (not by_truth)
        assert abs(float(re.search(r"bearing = (-?[\d.]+)", told)[1]) - np.radians(degrees)) < np.radians(0.2)


def test_one_target_is_enough():
    (told,) = scene(7, off=np.radians(3.0), reports=(2,))
    assert "1 target of ais" in told


@pytest.mark.costly
def test_radars_that_are_right_are_not_told_of():
    """Of 40 scenes none: at a rate of .02 a scene, one would come in more than half of the times that this runs."""
    for seed in range(20):
        assert not scene(100 + seed, off=0.0)
        assert not scene(200 + seed, off=0.0, by_truth=True, reports=(), clutter=100)


@pytest.mark.costly
def test_returns_in_x_and_y_are_looked_at_from_where_the_radar_is():
    for seed in range(4):
        (told,) = scene(seed, off=np.radians(-3.0), plane=True)
        assert abs(angle(told) + 3.0) < 0.2
        assert not scene(300 + seed, off=0.0, plane=True)


def scenes(count, **wrong):
    return [scene(seed, off=0.0, vessels=1, clutter=2, by_truth=True, reports=(), **wrong) for seed in range(count)]


@pytest.mark.costly
def test_an_offset_and_a_lag_are_no_turn():
    """Of one target; what was told of it as a turn without the rivals, of 12 scenes each, is in the test below."""
    for told in scenes(12, beside=(150.0, 0.0), plane=True) + scenes(12, late=25.0):
        assert not told or "do not tell apart" in told[0]


@pytest.mark.costly
def test_without_rivals_they_were(monkeypatch):
    monkeypatch.setattr(room, "rivals_of", lambda looks, angle: ())
    assert sum(map(len, scenes(12, beside=(150.0, 0.0), plane=True))) > 2
    assert sum(map(len, scenes(12, late=25.0))) > 2


def test_without_places_of_targets_nothing_is_told():
    assert not scene(1, off=np.radians(3.0), reports=())


def test_offsets_that_are_not_of_one_angle_are_not_told(monkeypatch):
    """The mutant: all that is near counts, so that clutter votes for some angle."""
    monkeypatch.setattr(room, "PART", 0.0)
    monkeypatch.setattr(room, "MORE", 0.0)
    assert any(scene(seed, off=np.radians(30.0), clutter=1500) for seed in range(6))


def test_what_is_not_of_the_targets_is_not_told():
    assert not any(scene(seed, off=np.radians(30.0), clutter=1500) for seed in range(6))


def test_exact_reports_are_not_compared_with_themselves_and_an_angle_that_is_told_as_none_is_not_told():
    tracker = vedette.build(
        {
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
            "sensors": {name: {"kind": "cartesian_position", "sigma": 0.15} for name in ("camera", "lidar")},
            "associator": {"kind": "jpda"},
            "lifecycle": {"kind": "existence"},
            "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
        }
    )
    at, v = np.stack([np.full(9, 2740.0), 1120 + 3.5 * np.arange(9)], axis=1), np.array([8.0, 0.0])
    scans = [
        Scan(0.1 * k, sensor, attrs.evolve(Detections.of(at + 0.1 * k * v, 2), identity=np.arange(9)))
        for k in range(47)
        for sensor in ("camera", "lidar")
    ]
    assert not list(turned(tracker, scans, []))
    assert not list(turned(tracker, [scan for scan in scans if scan.sensor == "camera"], []))
