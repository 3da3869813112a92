"""Scenes in configs, and what is wrong with them."""

import tomllib

import numpy as np
import pytest

import vedette
import vedette_sim as sim
from support.paths import EXAMPLES
from support.scenes import DRAWN, REGION, SENSORS, SHIPS, START, Peaked, Polar, Weaving, scene
from vedette import ConfigError, Pose, Sensor, Space, sampling
from vedette_standard.motion.constant_velocity import ConstantVelocity

SCENE_TOML = """
[estimator]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.1 }
[associator]
kind = "nearest"
[birth]
kind = "from_returns"
spread = { vx = 10, vy = 10 }
[lifecycle]
kind = "m_of_n"
[sensors.radar]
kind = "cartesian_position"
sigma = 5
clutter_density = 1e-5
[source]
kind = "simulation"
duration = "1 min"
ownship = { start = [0, 0], speed = "5 kn" }
sensors.radar = { kind = "cartesian_position", sigma = 8, clutter_density = 1e-5 }
[source.looks.radar]
interval = 2.5
clutter = { x = { low = -500, high = 500 }, y = { low = -500, high = 500 } }
[source.ships.ferry]
start = [100, -200]
course = "45 deg"
speed = "10 kn"
legs = [{ do = "straight", seconds = 20 }, { do = "turn", seconds = 30, rate = "1 deg/s" }, { do = "stop", decel = 0.1 }]
[source.drawn.boat]
models = [{ kind = "constant_velocity", sigma_accel = 0.1 }, { kind = "constant_velocity", sigma_accel = 2 }]
transition = [[0.9, 0.1], [0.3, 0.7]]
start = { x = [0, 10], y = [0, 10], vx = [0, 5], vy = [0, 5] }
"""


def test_a_config_describes_a_scene_and_the_scene_its_config():
    config = tomllib.loads(SCENE_TOML)
    experiment = vedette.load(config)
    again = vedette.load(vedette.to_config(experiment))
    scans, same = (each.source.open(each.tracker.sensors, np.random.default_rng(1)).scans for each in (experiment, again))
    assert len(scans) == 25
    for a, b in zip(scans, same, strict=True):
        np.testing.assert_array_equal(a.detections.z, b.detections.z)


def test_a_wrong_scene_is_told_with_the_paths_of_its_config():
    config = tomllib.loads(
        SCENE_TOML.replace("1 min", "0 min").replace('"45 deg"', '"45 m"').replace("decel = 0.1", "deccel = 0.1")
    )
    with pytest.raises(ConfigError) as told:
        vedette.load(config)
    for said in (
        "source.duration: must be > 0",
        "source.ships.ferry.course: must be in rad",
        "source.ships.ferry.legs[2].deccel",
    ):
        assert said in str(told.value)


def test_the_plugin_brings_the_scene():
    scenes = [sim.Simulation, sim.InfraredScene, sim.RadarPicturesScene, sim.RadarPointsScene]
    assert list(sim.vedette_components()) == scenes


CV = ConstantVelocity(0.1)


def rng() -> np.random.Generator:
    return np.random.default_rng(0)


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        (lambda: sim.Leg("swim"), "do: must be one of 'straight', 'turn'"),
        (lambda: sim.Leg("turn", seconds=3), r"seconds and rate.*got seconds"),
        (lambda: sim.Leg("turn", 3, rate=1, lateral_accel=1), "got seconds and rate and lateral_accel"),
        (lambda: sim.Leg("stop", 3, decel=1), "'stop' takes decel; got seconds"),
        (lambda: sim.Leg("straight"), "'straight' takes seconds; got none"),
        (lambda: sim.Leg("stop", decel=-1), "decel: must be > 0, got -1 m/s"),
        (lambda: sim.Leg("straight", seconds=float("nan")), "seconds: must be a finite number"),
        (lambda: sim.Ship([0]), r"start: must be \[x, y\]"),
        (lambda: sim.Ship([0, 0], speed=-1), "speed: must be >= 0, got -1 m/s"),
        (lambda: sim.Ship([0, 0], speed="3 deg"), "speed: must be in m/s or km/h"),
        (lambda: sim.Ship([0, 0], legs=(sim.Leg("turn", 3, lateral_accel=1),)), r"legs\[0\].lateral_accel: the ship is"),
        (lambda: sim.Ship([0, 0], speed=1, legs=(sim.Leg("accelerate", 3, accel=-1),)), r"legs\[0\].accel: .* 1 to -2 m/s"),
        (lambda: sim.Ship([0, 0], appears=5, disappears=5), r"disappears: must be after it appears.*5"),
        (lambda: sim.Ship([0, 0], appears=5).states(np.array([4.0])), r"no earlier than it appears.*5"),
        (lambda: sim.Look(0), "interval: must be > 0"),
        (lambda: sim.Look(2, jitter=1), r"jitter: must be < half the interval.*2"),
        (lambda: sim.Bounds(3, 3), "high: must be > low = 3, got 3"),
        (lambda: sim.Drawn((), START), "models: must hold at least one"),
        (lambda: sim.Drawn((CV,), {"x": [0, 1]}), r"start: must give the axes x, y.*got x"),
        (lambda: sim.Drawn((CV,), START | {"x": [0, -1]}), "start: x: the standard deviation must be >= 0"),
        (lambda: sim.Drawn((CV, CV), START), "transition: must be 2 x 2"),
        (lambda: sim.Drawn((CV, CV), START, [[1, 0.5], [0, 1]]), r"rows of probabilities that sum.*1"),
        (lambda: sim.Drawn((CV,), START, appears=4, disappears=3), r"disappears: must be after.*got 3 s"),
        (lambda: scene(looks={}), "looks: must hold at least one"),
        (lambda: scene(duration=11), r"ships.tug.appears: must be before the end.*11"),
        (lambda: scene(drawn={"tug": DRAWN["boat"]}), "drawn.tug: a ship has this name too"),
        (lambda: scene(sensors={"sonar": SENSORS["radar"]}), r"sensors.sonar: never looks; there are looks"),
        (lambda: scene(ownship=SHIPS["tug"]), "ownship: must be there all"),
        (lambda: scene(looks={"radar": sim.Look(2.0, first=1e4)}), "looks.radar.first: must not be"),
        (lambda: scene(duration=1e12), "looks.radar.interval: makes more than 1000000 scans"),
        (lambda: sampling.follow(CV, np.zeros(3), np.arange(2.0), np.zeros((1, 4))), "x0: must have the 4 axes"),
        (lambda: sampling.follow(CV, np.zeros(4), np.arange(2.0), np.zeros((2, 4))), "standard: must end in"),
        (lambda: sampling.draw_states(CV, np.zeros(4), np.array([1.0, 0.0]), rng()), "times: .* never going back"),
        (lambda: sampling.draw_states(CV, np.zeros(4), np.array([np.nan]), rng()), "times: must be finite"),
        (lambda: sampling.switch(np.ones((2, 2)), 0, np.arange(2.0), np.zeros(1)), "transition: must be square"),
        (lambda: sampling.switch(np.eye(2), 2, np.arange(2.0), np.zeros(1)), r"mode0: must be one.*got 2"),
        (
            lambda: sampling.draw_jump_markov((CV, Weaving()), np.eye(2), np.zeros(5), 0, np.arange(2.0), rng()),
            "starts: must give .* of turn_rate",
        ),
        (
            lambda: sampling.draw_jump_markov((CV,), np.eye(2), np.zeros(4), 0, np.arange(2.0), rng()),
            r"one row for each.*got 2",
        ),
        (lambda: sampling.draw_detections(Polar(), np.zeros((1, 4)), rng()), "x: must have the 2 axes"),
        (lambda: sampling.draw_clutter(Polar(), {}, rng()), "range: must have a low and a high"),
        (lambda: sampling.draw_clutter(Polar(), REGION | {"x": sim.Bounds(0, 1)}, rng()), "x: is not measured"),
        (
            lambda: sampling.draw_clutter(Polar(), REGION | {"bearing": sim.Bounds(0, 7)}, rng()),
            r"bearing: must span at most 6.28319.*got 7",
        ),
        (lambda: sampling.draw_clutter(Polar(density=1e3), REGION, rng()), "false returns a scan; check"),
        (lambda: sampling.draw_clutter(Polar(density=-1e-6), REGION, rng()), "must be finite and >= 0"),
        (lambda: sampling.draw_clutter(Peaked(), REGION, rng(), (2000,)), "peaks too sharply"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said(wrong, said):
    with pytest.raises(ValueError, match=said):
        wrong()


@pytest.mark.parametrize(
    ("changes", "sensors", "said"),
    [
        ({}, {"radar": SENSORS["radar"]}, r"looks.lidar: there is no such sensor"),
        (
            {"sensors": {"lidar": Polar()}},
            SENSORS,
            r"sensors.lidar: must measure.*got .*range",
        ),
        (
            {"looks": {"radar": sim.Look(1, clutter={"x": sim.Bounds(0, 1)})}},
            SENSORS,
            "looks.radar.clutter: x: is not measured",
        ),
        (
            {"looks": {"radar": sim.Look(1, clutter=REGION)}},
            {"radar": Polar(density=1e3)},
            "looks.radar: test_polar: .* false returns a scan",
        ),
    ],
)
def test_a_scene_that_does_not_fit_the_sensors_is_said_to(changes, sensors, said):
    with pytest.raises(ConfigError, match=said):
        scene(**changes).open(sensors, np.random.default_rng(0))


def test_a_sensor_that_looks_at_axes_nobody_has_is_refused():
    class Doppler(Polar):
        @property
        def observes(self) -> Space:
            return Space.of(x="m", y="m", vz="m/s")

    with pytest.raises(ConfigError, match=r"looks.radar: it looks at .*vz.*, but 'ferry' has"):
        scene().open(SENSORS | {"radar": Doppler()}, np.random.default_rng(0))


def test_a_sensor_that_cannot_be_carried_is_refused_on_a_ship():
    class Mast(Polar):
        def at(self, pose: Pose) -> Sensor:
            return Sensor.at(self, pose)

    with pytest.raises(ConfigError, match=r"looks.radar: .*cannot be placed on a moving platform"):
        scene(ownship=sim.Ship([0, 0])).open(SENSORS | {"radar": Mast()}, np.random.default_rng(0))


def test_an_experiment_says_where_in_the_config_its_source_is_wrong():
    with (EXAMPLES / "harbour.toml").open("rb") as file:
        config = tomllib.load(file)
    config["source"]["looks"]["lidar"] = {"interval": 1.0}
    with pytest.raises(vedette.ConfigError, match=r"^source\.looks\.lidar: there is no such sensor"):
        vedette.load(config).run()
