"""Simulated scenes: what they hold, and on what they depend.

Every statistical test accepts at a false alarm rate of ALPHA, whatever the seed.
"""

import os
import subprocess
import sys

import numpy as np
import pytest

import vedette_sim as sim
from support.scenes import SENSORS, SHIPS, START, Polar, Weaving, rows, scene
from support.statistics import moments_match
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition


def test_a_scene_holds_its_looks_in_time_order_and_its_truth_at_each():
    recording = scene().open(SENSORS, np.random.default_rng(1))
    times = [scan.time for scan in recording.scans]
    assert times == sorted(times)
    radar = [scan.time for scan in recording.scans if scan.sensor == "radar"]
    np.testing.assert_allclose(radar, np.arange(25) * 2.5)
    lidar = np.array([scan.time for scan in recording.scans if scan.sensor == "lidar"])
    early = lidar - (0.3 + 0.7 * np.arange(len(lidar)))
    assert len(lidar) == 86
    assert np.all(np.abs(early) <= 0.2)
    assert early.min() < -0.1
    assert early.max() > 0.1
    assert [each.name for each in recording.truth] == ["ferry", "tug", "boat"]
    for each in recording.truth[:2]:
        ship = SHIPS[each.name]
        alive = [t for t in times if ship.appears <= t <= (ship.disappears or 60)]
        assert set(alive) <= set(each.times)
        for time in times:
            if time in alive:
                np.testing.assert_array_equal(each.at(time), ship.states(np.array(time)))
            else:
                assert each.at(time) is None
        assert np.all(np.diff(each.times) > 0)
    assert all(np.all(scan.detections.valid) and scan.pose is None for scan in recording.scans)


def test_objects_give_returns_only_while_they_are_there():
    exact = {"radar": CartesianPosition(sigma=1e-6)}
    recording = scene(looks={"radar": sim.Look(interval=2.5)}, drawn={}).open(exact, np.random.default_rng(1))
    for scan in recording.scans:
        there = [state[:2] for each in recording.truth if (state := each.at(scan.time)) is not None]
        z = np.array(sorted(scan.detections.z.tolist()))
        np.testing.assert_allclose(z, np.array(sorted(map(list, there))), atol=1e-4)
    assert {len(scan.detections.z) for scan in recording.scans} == {1, 2}


def test_another_object_changes_nothing_for_the_rest():
    late = {"late": sim.Ship(start=[100, 0], appears=20)}
    before = scene().open(SENSORS, np.random.default_rng(3))
    after = scene(ships=late | SHIPS).open(SENSORS, np.random.default_rng(3))
    paths = {each.name: each for each in after.truth}
    for each in before.truth:
        np.testing.assert_array_equal(each.times, paths[each.name].times)
        np.testing.assert_array_equal(each.states, paths[each.name].states)
    for name in SENSORS:
        assert rows(before, name) < rows(after, name)
    fewer = scene(drawn={}).open(SENSORS, np.random.default_rng(3))
    assert rows(fewer, "radar") < rows(before, "radar")


@pytest.mark.costly
def test_two_sensors_err_independently():
    twins = {name: CartesianPosition(sigma=1.0) for name in ("left", "right")}
    looks = {name: sim.Look(interval=0.05) for name in twins}
    recording = scene(looks=looks, ships={}).open(twins, np.random.default_rng(3))
    left, right = (np.array([s.detections.z[0] for s in recording.scans if s.sensor == name]) for name in twins)
    path = recording.truth[0].states[:, :2]
    errors = np.concatenate([left - path, right - path], axis=1)
    assert errors.shape == (1201, 4)
    assert moments_match(errors, np.zeros(4), np.eye(4))


def test_seeds_differ_and_one_seed_repeats():
    first, again, other = (scene().open(SENSORS, np.random.default_rng(seed)) for seed in (3, 3, 4))
    for a, b in zip(first.scans, again.scans, strict=True):
        np.testing.assert_array_equal(a.detections.z, b.detections.z)
    assert not rows(first, "radar") & rows(other, "radar")
    assert not np.any(first.truth[2].states == other.truth[2].states)


PRINT_DIGEST = """
import hashlib, sys
import numpy as np
import vedette_sim as sim
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.sensors.cartesian_position import CartesianPosition
box = {"x": sim.Bounds(-500, 500), "y": sim.Bounds(-500, 500)}
start = {"x": [0, 100], "y": [0, 100], "vx": [0, 5], "vy": [0, 5]}
drawn = sim.Drawn((ConstantVelocity(0.1), ConstantVelocity(2.0)), start, [[0.9, 0.1], [0.3, 0.7]])
scene = sim.Simulation(
    duration=30,
    looks={"radar": sim.Look(2.5, clutter=box), "lidar": sim.Look(1.0, jitter=0.2)},
    ships={"a": sim.Ship([0, 0], speed=3), "b": sim.Ship([9, 9], speed=1)},
    drawn={"c": drawn, "d": drawn},
)
sensor = CartesianPosition(5, 0.8, 1e-5)
recording = scene.open({"radar": sensor, "lidar": sensor}, np.random.default_rng(7))
digest = hashlib.sha256()
for scan in recording.scans:
    digest.update(repr((scan.time, scan.sensor)).encode() + scan.detections.z.tobytes())
for each in recording.truth:
    digest.update(each.name.encode() + each.times.tobytes() + each.states.tobytes())
print(digest.hexdigest())
"""


@pytest.mark.costly
def test_two_processes_with_unlike_hash_seeds_draw_the_same_bits():
    digests = {
        subprocess.run(
            [sys.executable, "-c", PRINT_DIGEST],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in ("0", "1", "4711")
    }
    assert len(digests) == 1


def test_a_moving_platform_sees_from_where_it_is_and_along_its_bow():
    own = sim.Ship(start=[-200, 100], course=2.0, speed=6, legs=(sim.Leg("turn", 30, rate=-0.1), sim.Leg("stop", decel=1)))
    exact = {"radar": Polar(1e-6, 1e-9, 1.0)}
    ships = {"tug": SHIPS["ferry"]}
    looks = {"radar": sim.Look(interval=2.5)}
    recording = scene(looks=looks, ships=ships, drawn={}, ownship=own).open(exact, np.random.default_rng(1))
    for scan in recording.scans:
        expected = own.states(np.array(scan.time))
        np.testing.assert_array_equal(scan.pose.position, expected[:2])
        np.testing.assert_array_equal(scan.pose.velocity, expected[2:])
        assert scan.pose.heading == own.heading(np.array(scan.time))
        for distance, bearing in scan.detections.z:
            angle = bearing + scan.pose.heading
            seen = scan.pose.position + distance * np.array([np.cos(angle), np.sin(angle)])
            np.testing.assert_allclose(seen, recording.truth[0].at(scan.time)[:2], atol=1e-4)
    assert sum(len(scan.detections.z) for scan in recording.scans) == 18
    resting = recording.scans[-1].pose
    np.testing.assert_allclose(resting.heading, 2.0 - 3.0)
    assert np.all(resting.velocity == 0)


def test_the_scene_may_have_another_sensor_than_the_tracker():
    other = {"lidar": CartesianPosition(sigma=20.0)}
    recording = scene(sensors=other, ships={}).open(SENSORS, np.random.default_rng(1))
    lidar = [scan for scan in recording.scans if scan.sensor == "lidar"]
    assert all(len(scan.detections.z) == 1 for scan in lidar)
    errors = np.array([scan.detections.z[0] - recording.truth[0].at(scan.time)[:2] for scan in lidar])
    assert moments_match(errors, np.zeros(2), 400.0 * np.eye(2))


def test_an_object_that_switches_models_is_seen_by_what_its_models_share():
    jumping = sim.Drawn(
        (ConstantVelocity(0.3), Weaving()),
        START | {"turn_rate": [0, 0.1]},
        [[0.8, 0.2], [0.2, 0.8]],
        appears=3,
        disappears=50,
    )
    recording = scene(ships={}, drawn={"boat": jumping}).open(SENSORS, np.random.default_rng(1))
    path = recording.truth[0]
    assert path.space.names == ("x", "y", "vx", "vy")
    assert np.all(np.isfinite(path.states))
    assert (path.times[0], path.times[-1]) == (3.0, 50.0)


@pytest.mark.costly
def test_a_drawn_object_starts_where_it_is_said():
    still = {name: [7.0, 0.0] for name in START}
    drawn = {str(i): sim.Drawn((ConstantVelocity(0.3),), START) for i in range(1000)}
    looks = {"lidar": sim.Look(interval=60)}
    recording = scene(looks=looks, ships={}, drawn=drawn).open(SENSORS, np.random.default_rng(1))
    begins = np.array([each.states[0] for each in recording.truth])
    assert moments_match(begins, np.zeros(4), np.diag([1e4, 1e4, 25.0, 25.0]))
    fixed = scene(ships={}, drawn={"boat": sim.Drawn((ConstantVelocity(0.3),), still)}).open(
        SENSORS, np.random.default_rng(1)
    )
    assert fixed.truth[0].states[0].tolist() == [7.0, 7.0, 7.0, 7.0]
