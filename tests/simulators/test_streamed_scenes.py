"""A long scene is drawn as it is asked for, in whatever order: the very scans of one drawn whole."""

import gc
import tracemalloc

import numpy as np
import pytest

import vedette
from support.ships import AROUND, RADAR, radar_and_beacon
from vedette import ConfigError, Sensor
from vedette_sim import scenario, streamed_scene
from vedette_standard.sensors.cartesian_position import CartesianPosition

CONFIG = radar_and_beacon(
    {
        "one": {"start": [0.0, 0.0], "speed": 5.0},
        "two": {"start": [300.0, -200.0], "speed": 8.0, "appears": 30.0, "disappears": 70.0},
        "three": {"start": [-300.0, 200.0], "speed": 2.0, "appears": 55.5},
    },
    duration=90.0,
    radar=RADAR | {"detection_probability": 0.8},
    looks={"radar": AROUND | {"jitter": 0.3}, "beacon": {"interval": 2.0}},
)


def scans(monkeypatch, whole, block=streamed_scene.BLOCK, config=CONFIG):
    """The scans of the scene; drawn whole in one block, or as they are asked for in blocks of this size."""
    experiment = vedette.load(config)
    with monkeypatch.context() as patch:
        patch.setattr(scenario, "_WHOLE", 10**9 if whole else 3)
        patch.setattr(scenario, "BLOCK", block)
        patch.setattr(streamed_scene, "BLOCK", block)
        found = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(4)).scans
        yield from found
        if not whole:
            assert isinstance(found, streamed_scene.LazyScene)
            for i in (5, 3, 90, -1, 0):
                same(found[i], list(found)[i])
            same(found[7:9][1], found[8])
            assert len(list(found)) == len(found)


def same(one, other):
    assert (one.time, one.sensor) == (other.time, other.sensor)
    np.testing.assert_array_equal(one.detections.z, other.detections.z)
    np.testing.assert_array_equal(one.detections.valid, other.detections.valid)


def check(monkeypatch, block):
    whole = list(scans(monkeypatch, whole=True, block=10**6))
    found = list(scans(monkeypatch, whole=False, block=block))
    assert len(whole) == len(found) == 91 + 46
    for one, other in zip(whole, found, strict=True):
        same(one, other)


@pytest.mark.parametrize("block", [1, 7, 500])
@pytest.mark.by_turns
def test_the_scans_are_those_of_a_scene_drawn_whole(monkeypatch, block):
    check(monkeypatch, block)


def from_the_start(self, name, begin):
    return self._stream(name), self._stream(name)


def in_one_stream(self, name, begin):
    even, _ = begun(self, name, begin)
    return even, even


begun = streamed_scene.Views._begun
MUTANTS = {
    "a late object's numbers from its stream's start": ("_begun", from_the_start),
    "normal numbers in between the uniform ones": ("_begun", in_one_stream),
}


@pytest.mark.parametrize("name", MUTANTS)
@pytest.mark.by_turns
def test_a_mutant_is_caught(monkeypatch, name):
    attribute, mutant = MUTANTS[name]
    monkeypatch.setattr(streamed_scene.Views, attribute, mutant)
    with pytest.raises(AssertionError):
        check(monkeypatch, 7)


def test_what_a_sensor_cannot_do_is_an_error_when_the_scene_is_opened(monkeypatch):
    class Mast(CartesianPosition):
        def at(self, pose):
            return Sensor.at(self, pose)

    monkeypatch.setattr(scenario, "_WHOLE", 3)
    experiment = vedette.load(CONFIG | {"source": CONFIG["source"] | {"ownship": {"start": [0.0, 0.0]}}})
    sensors = dict(experiment.tracker.sensors) | {"radar": Mast(sigma=5.0)}
    with pytest.raises(ConfigError, match=r"looks\.radar: .*cannot be placed on a moving platform"):
        experiment.source.open(sensors, np.random.default_rng(0))


@pytest.mark.costly
def test_memory_does_not_grow_with_the_scans(monkeypatch):
    """A scene 10 times as long takes no more while it is walked through; one that is kept takes far more."""
    look = {"radar": CONFIG["source"]["looks"]["radar"] | {"jitter": 0.0}}
    one = CONFIG | {"source": {"kind": "simulation", "duration": 6000.0, "looks": look, "ships": {"a": {"start": [0, 0]}}}}
    experiment = vedette.load(one)
    recording = experiment.source.open(experiment.tracker.sensors, np.random.default_rng(4))
    used, kept = [], []
    tracemalloc.start()
    try:
        for i, scan in enumerate(recording.scans):
            kept.append(scan) if i < 1000 else kept.clear()
            if i in (999, 1500, 5900):
                gc.collect()
                used.append(tracemalloc.get_traced_memory()[0])
    finally:
        tracemalloc.stop()
    assert abs(used[2] - used[1]) < 50_000 < 300_000 < used[0] - used[1]
