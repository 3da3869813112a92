"""Populations, crossings and convoys: their laws, each accepted at a false alarm rate of ALPHA, and what they depend on."""

from itertools import pairwise

import numpy as np
import pytest
from scipy import stats

import vedette
import vedette_sim as sim
from support.paths import EXAMPLES
from support.scenes import SENSORS, START, Weaving, rows, scene
from support.statistics import ALPHA, dispersion_p, moments_match
from vedette.metrics import judge
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_standard.motion.gauss_markov import GaussMarkov
from vedette_standard.sensors.cartesian_position import CartesianPosition

CV = ConstantVelocity(0.3)
SPEEDS = {"vx": [0, 5], "vy": [0, 5]}
BOX = {"x": sim.Bounds(-500, 500), "y": sim.Bounds(-100, 100)}
TIMES = np.arange(0.0, 60.0, 7.0)


def drawn(group, seed, times=TIMES, duration=60.0):
    return group.members("g", times, duration, np.random.default_rng(seed))


def alive(paths, time):
    return sum(path.times[0] <= time <= path.times[-1] for path in paths)


@pytest.mark.costly
def test_births_and_deaths_are_poisson_at_their_rates():
    births = sim.Population((CV,), START, rate=0.2, lifetime=40.0)
    scenes = [drawn(births, seed) for seed in range(80)]
    assert dispersion_p(np.array([len(paths) for paths in scenes]), 0.2 * 60) > ALPHA
    born = np.concatenate([[path.times[0] for path in paths] for paths in scenes])
    assert stats.kstest(born / 60, "uniform").pvalue > ALPHA
    for time in (7.0, 56.0):
        there = np.array([alive(paths, time) for paths in scenes])
        assert dispersion_p(there, 0.2 * 40 * (1 - np.exp(-time / 40))) > ALPHA


def test_a_population_into_which_nobody_is_born_has_no_members():
    assert any(not drawn(sim.Population((CV,), START, rate=0.01), seed) for seed in range(20))


def test_those_of_the_beginning_die_out_at_their_rate():
    paths = drawn(sim.Population((CV,), SPEEDS, BOX, count=2000, lifetime=40.0), 3)
    assert len(paths) == 2000
    for time in (7.0, 35.0, 56.0):
        assert stats.binomtest(alive(paths, time), 2000, np.exp(-time / 40)).pvalue > ALPHA
    stay = drawn(sim.Population((CV,), SPEEDS, BOX, count=20), 3)
    assert {path.times[-1] for path in stay} == {60.0}


@pytest.mark.costly
def test_a_population_starts_where_it_is_said_and_moves_by_its_model():
    paths = drawn(sim.Population((CV,), SPEEDS, BOX, count=600, rate=2.0), 4)
    first = np.array([path.states[0] for path in paths])
    for axis, low, high in ((0, -500, 500), (1, -100, 100)):
        assert stats.kstest((first[:, axis] - low) / (high - low), "uniform").pvalue > ALPHA
    assert moments_match(first[:, 2:], np.zeros(2), 25.0 * np.eye(2))
    steps = []
    for path in paths:
        for k, dt in enumerate(np.diff(path.times)):
            moved = path.states[k + 1] - CV.move(path.states[k], dt)
            steps.append(np.linalg.solve(np.linalg.cholesky(CV.noise(path.states[k], dt)), moved))
    assert moments_match(np.array(steps), np.zeros(4), np.eye(4))
    born = [path.times for path in paths if path.times[0] > 0]
    assert all(set(times[1:]) == {t for t in (*TIMES, 60.0) if t > times[0]} for times in born)


@pytest.mark.costly
def test_a_population_switches_models_at_every_step_from_the_first():
    models = (ConstantVelocity(1e-6), ConstantVelocity(10.0))
    turns = [[0.7, 0.3], [0.2, 0.8]]
    paths = drawn(sim.Population(models, START, count=500, rate=4.0, transition=turns), 5)
    wild = [np.linalg.norm(np.diff(path.states[:, 2:], axis=0), axis=1) > 1e-3 for path in paths if len(path.times) > 2]
    assert stats.binomtest(sum(int(each[0]) for each in wild), len(wild), 0.3).pvalue > ALPHA
    after = [(bool(a), bool(b)) for each in wild for a, b in pairwise(each)]
    for was, chance in ((False, 0.3), (True, 0.8)):
        then = [b for a, b in after if a is was]
        assert stats.binomtest(sum(then), len(then), chance).pvalue > ALPHA


def test_a_population_may_have_models_with_unlike_axes():
    group = sim.Population((CV, Weaving()), START | {"turn_rate": [0, 0.1]}, count=5, rate=1.0, transition=[[0.5, 0.5]] * 2)
    paths = drawn(group, 6)
    assert all(path.space.names == ("x", "y", "vx", "vy") and np.all(np.isfinite(path.states)) for path in paths)


def test_a_crossing_meets_at_its_place_and_time():
    group = sim.Crossing((CV,), at=[100, -50], time=30.5, speed=8, count=4, course=0.3)
    paths = drawn(group, 1)
    assert [path.name for path in paths] == ["g.1", "g.2", "g.3", "g.4"]
    for i, path in enumerate(paths):
        np.testing.assert_allclose(path.at(30.5)[:2], [100, -50], atol=1e-9)
        course = 0.3 + i * np.pi / 2
        np.testing.assert_allclose(path.states[0, 2:], [8 * np.cos(course), 8 * np.sin(course)])
        assert np.linalg.norm(path.states[0, :2] - [100, -50]) > 60
        assert set(TIMES) <= set(path.times)
    narrow = drawn(sim.Crossing((CV,), at=[0, 0], time=0.0, speed=1, angle="10 deg"), 1)
    np.testing.assert_allclose(narrow[1].states[0], [0, 0, np.cos(np.pi / 18), np.sin(np.pi / 18)], atol=1e-12)


def test_a_crossings_paths_are_draws_of_its_models_and_miss_by_its_spread():
    group = sim.Crossing((CV,), at=[100, -50], time=28.0, speed=8, count=800, spread=3.0)
    paths = drawn(group, 2)
    assert moments_match(np.array([path.at(28.0)[:2] for path in paths]), np.array([100, -50]), 9.0 * np.eye(2))
    lower = np.linalg.cholesky(CV.noise(paths[0].states[0], 7.0))
    moved = np.array([path.states[1:8] - CV.move(path.states[:7], 7.0) for path in paths]).reshape(-1, 4)
    assert moments_match(np.linalg.solve(lower, moved.T).T, np.zeros(4), np.eye(4))


@pytest.mark.parametrize(("formation", "side"), [("astern", [-1, 0]), ("abreast", [0, 1])])
def test_a_convoy_keeps_its_formation(formation, side):
    leader = sim.Drawn((CV,), START, appears=5.0, disappears=50.0)
    paths = drawn(sim.Convoy(leader, 40.0, formation, 3), 7)
    first = paths[0]
    ahead = first.states[0, 2:] / np.linalg.norm(first.states[0, 2:])
    frame = np.array([ahead, [-ahead[1], ahead[0]]])
    for i, path in enumerate(paths):
        np.testing.assert_array_equal(path.times, first.times)
        np.testing.assert_array_equal(path.states[:, 2:], first.states[:, 2:])
        off = (path.states - first.states)[:, :2] @ frame.T
        np.testing.assert_allclose(off, np.broadcast_to(40.0 * i * np.array(side), off.shape), atol=1e-9)
    assert (first.times[0], first.times[-1]) == (5.0, 50.0)


def test_the_members_of_a_convoy_wander_by_their_model_and_independently():
    leader = sim.Drawn((ConstantVelocity(1e-9),), {name: [0.0, 0.0] for name in START})
    wander = GaussMarkov(("x", "y"), 2.0, 10.0)
    paths = drawn(sim.Convoy(leader, 40.0, "astern", 600, wander), 8)
    places = np.array([path.states[-1, :2] for path in paths]) - [[-40.0 * i, 0] for i in range(600)]
    assert moments_match(places, np.zeros(2), 4.0 * (1 - np.exp(-12.0)) * np.eye(2))
    off = np.array([path.states[3, :2] for path in paths]) - [[-40.0 * i, 0] for i in range(600)]
    assert moments_match(off, np.zeros(2), 4.0 * (1 - np.exp(-2 * 21 / 10)) * np.eye(2))


GROUPS = {
    "populations": {"boats": sim.Population((CV,), SPEEDS, BOX, count=3, rate=0.1, lifetime=30.0)},
    "crossings": {"meeting": sim.Crossing((CV,), at=[0, 0], time=20, speed=5)},
    "convoys": {"ferries": sim.Convoy(sim.Drawn((CV,), START), 30.0, "abreast")},
}


@pytest.mark.costly
def test_a_group_changes_nothing_for_the_others():
    plain = scene().open(SENSORS, np.random.default_rng(3))
    whole = scene(**GROUPS).open(SENSORS, np.random.default_rng(3))
    paths = {path.name: path for path in whole.truth}
    assert {"boats.1", "meeting.2", "ferries.2", "ferry", "boat"} <= set(paths)
    for path in plain.truth:
        np.testing.assert_array_equal(path.states, paths[path.name].states)
    for sensor in SENSORS:
        assert rows(plain, sensor) < rows(whole, sensor)
    for table in GROUPS:
        without = scene(**{name: groups for name, groups in GROUPS.items() if name != table})
        some = {path.name: path for path in without.open(SENSORS, np.random.default_rng(3)).truth}
        assert set(some) < set(paths)
        assert all(np.array_equal(path.states, paths[name].states) for name, path in some.items())


def test_a_scene_of_a_group_alone_is_not_drawn_in_lock_step():
    alone = scene(ships={}, looks={"lidar": sim.Look(1.0)}, populations=GROUPS["populations"])
    lidar = {"lidar": CartesianPosition(1.0)}
    assert alone.open_together(lidar, [np.random.default_rng(0)]) is None


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: sim.Population((CV,), START), r"count: must be > 0 where there.*got 0"),
        (lambda: sim.Population((CV,), START, BOX, count=1), "start: must give the axes"),
        (lambda: sim.Population((CV,), START, {"z": sim.Bounds(0, 1)}, count=1), "area: z is not an axis"),
        (lambda: sim.Population((CV, CV), START, count=1), "transition: must be 2 x 2"),
        (lambda: sim.Population((CV,), START, rate=-1), "rate: must be >= 0, got -1 1/s"),
        (lambda: scene(populations={"g": sim.Population((CV,), START, rate=1e6)}), "populations.g.rate: makes more than"),
        (lambda: sim.Crossing((CV,), [0, 0], 5, 3, appears=6), r"time: must be while they.*got 5 s"),
        (lambda: sim.Crossing((CV,), [0, 0], 5, 3, start={"x": [0, 1]}), r"start: must give the axes.*got x"),
        (lambda: sim.Crossing((CV,), [0], 5, 3), r"at: must be \[x, y\], got 1 numbers"),
        (lambda: sim.Crossing((GaussMarkov(("x", "y"), 1, 1),), [0, 0], 5, 3), "axes x, y, vx, vy; vx"),
        (
            lambda: scene(crossings={"g": sim.Crossing((CV,), [0, 0], 61, 3)}),
            r"crossings.g.time: must be before the end.*60",
        ),
        (
            lambda: sim.Convoy(sim.Drawn((CV,), START), 1, "astern", wander=Weaving()),
            "wander: has the axis turn_rate, which",
        ),
        (lambda: sim.Convoy(sim.Drawn((CV,), START), 1, "in line"), "formation: must be one of 'astern', 'abreast'"),
        (
            lambda: scene(convoys={"g": sim.Convoy(sim.Drawn((CV,), START, appears=70), 1, "astern")}),
            "convoys.g.leader.appears: must be before the end",
        ),
        (lambda: scene(convoys={"ferry": GROUPS["convoys"]["ferries"]}), r"convoys.ferry: another object has this"),
        (
            lambda: scene(populations={"g": GROUPS["populations"]["boats"]}, ships={"g.1": sim.Ship([0, 0])}),
            r"populations.g: another object has this",
        ),
    ],
)
def test_what_is_wrong_is_told(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


def test_the_fleet_of_the_examples_is_drawn_and_tracked():
    experiment = vedette.load(EXAMPLES / "fleet.toml")
    result = experiment.run()
    assert not result.refused
    assert {path.name.split(".")[0] for path in result.recording.truth} == {"boats", "meeting", "ferries"}
    score = judge(result.tracks, result.recording.truth, result.scans, experiment.judge)
    assert score.coverage > 0.7
    again = vedette.load(vedette.to_config(experiment)).source.open(experiment.tracker.sensors, np.random.default_rng(2))
    scans = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(2)).scans
    assert all(np.array_equal(a.detections.z, b.detections.z) for a, b in zip(scans, again.scans, strict=True))
