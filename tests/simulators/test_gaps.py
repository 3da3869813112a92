"""Returns that lack components by chance: statistics accept at a false alarm rate of ALPHA."""

import numpy as np
import pytest
from scipy import stats

import vedette
import vedette_sim as sim
from support.statistics import ALPHA
from vedette import ConfigError
from vedette_files import write_recording
from vedette_standard.sensors.partial import Partial
from vedette_standard.sensors.range_bearing_rate import RangeBearingRate

DOPPLER = RangeBearingRate(10.0, 0.01, 1.0, detection_probability=0.9)
SENSORS = {"radar": Partial(DOPPLER, optional={"range_rate": 60.0})}


def opened(missing, tracked=SENSORS, duration=3000.0, **more):
    look = sim.Look(1.0, missing=missing)
    scene = sim.Simulation(duration, {"radar": look}, {"a": sim.Ship([1000.0, 200.0], speed=0.1)}, **more)
    return scene.open(tracked, np.random.default_rng(2))


def test_returns_lack_a_component_as_often_as_stated_and_are_else_the_same():
    gaps, whole = opened({"range_rate": 0.3}), opened({})
    seen = [scan.detections for scan in gaps.scans if len(scan.detections.z)]
    lacking = np.concatenate([np.zeros_like(one.z, dtype=bool) if one.missing is None else one.missing for one in seen])
    z = np.concatenate([one.z for one in seen])
    assert not lacking[:, :2].any()
    assert stats.binomtest(int(lacking[:, 2].sum()), len(lacking), 0.3).pvalue > ALPHA
    np.testing.assert_array_equal(np.isnan(z), lacking)
    same = np.concatenate([scan.detections.z for scan in whole.scans])
    np.testing.assert_array_equal(z[~lacking], same[~lacking])
    assert all(scan.detections.missing is None for scan in whole.scans)


@pytest.mark.parametrize(
    ("missing", "sensors", "more"),
    [
        ({"range": 0.1}, SENSORS, {}),
        ({"range_rate": 0.1}, {"radar": DOPPLER}, {}),
        ({"range_rate": 0.1}, {"radar": DOPPLER}, {"sensors": SENSORS}),
    ],
    ids=["always reported", "not partial", "the tracker's is not"],
)
def test_what_a_sensor_always_reports_cannot_be_missing(missing, sensors, more):
    with pytest.raises(ConfigError, match=r"looks\.radar\.missing"):
        opened(missing, sensors, 10.0, **more)
    with pytest.raises(ValueError, match="probability"):
        sim.Look(1.0, missing={"range_rate": 1.5})


def test_a_scene_with_gaps_is_not_drawn_in_lock_step_without_them():
    rngs = [np.random.default_rng(1)]
    for missing, together in (({}, True), ({"range_rate": 0.5}, False)):
        scene = sim.Simulation(10.0, {"radar": sim.Look(1.0, missing=missing)}, {"a": sim.Ship([1000.0, 200.0], speed=0.1)})
        assert (scene.open_together(SENSORS, rngs) is not None) == together


def test_a_recording_of_a_scene_with_gaps_gives_the_same_tracks(tmp_path):
    config = {
        "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
        "sensors": {"radar": SENSORS["radar"]},
        "associator": {"kind": "pda"},
        "birth": {"kind": "given", "start": {"x": [1000, 20], "y": [200, 20], "vx": [5, 1], "vy": [3, 1]}},
        "lifecycle": {"kind": "single_target"},
    }
    ship = {"start": [1000, 200], "course": 0.5, "speed": 6}
    scene = {"kind": "simulation", "duration": 60, "looks": {"radar": {"interval": 2, "missing": {"range_rate": 0.3}}}}
    result = vedette.load({**config, "source": {**scene, "ships": {"a": ship}}}).run()
    write_recording(tmp_path / "r.jsonl", result.recording, {"radar": DOPPLER.measurement})
    again = vedette.load({**config, "source": {"kind": "jsonl", "path": str(tmp_path / "r.jsonl")}}).run()
    for one, other in zip(result.tracks, again.tracks, strict=True):
        np.testing.assert_array_equal(one.mean, other.mean)
    told = result.to_dataframe("detections")["range_rate"]
    assert told.isna().any()
    assert not told.isna().all()
