"""A run says where returns, or detections of its tracks, are many times as many as its sensors state, or as few."""

import re
from types import SimpleNamespace

import numpy as np
import pytest
from attrs import evolve

import vedette
from vedette_report.detector_errors import in_tracks
from vedette_report.running import growing
from vedette_report.running.streaming import stream
from vedette_report.series import recorder
from vedette_report.warnings.late import late
from vedette_report.warnings.stated import otherwise

RADAR = {"kind": "cartesian_position", "sigma": 10.0, "detection_probability": 0.9, "clutter_density": 3e-7}
BOX = {"low": -1000.0, "high": 2000.0}
BOATS = {
    name: {
        "models": [{"kind": "constant_velocity", "sigma_accel": 0.3}],
        "start": {"x": [x, 20], "y": [0, 20], "vx": [vx, 1], "vy": [4, 1]},
    }
    for name, x, vx in (("a", 0, 5), ("b", 1000, -3))
}


FLEET = {
    f"{row}{column}": {
        "models": [{"kind": "constant_velocity", "sigma_accel": 0.1}],
        "start": {"x": [100.0 * row, 20], "y": [100.0 * column, 20], "vx": [5, 0.1], "vy": [4, 0.1]},
    }
    for row in range(6)
    for column in range(6)
}


def experiment_of(seed=0, world=None, boats=BOATS, duration=240, **changes):
    """Return a run of boats that a radar sees, which is not as stated by these changes, or whose world is not."""
    return vedette.load(
        {
            "seed": seed,
            "source": {
                "kind": "simulation",
                "duration": duration,
                "drawn": boats,
                "looks": {"radar": {"interval": 2.0, "clutter": {"x": BOX, "y": BOX}}},
                "sensors": {"radar": RADAR | (world or {})},
            },
            "sensors": {"radar": RADAR | changes},
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
            "associator": {"kind": "pda"},
            "birth": {"kind": "from_returns", "spread": {"vx": 6.0, "vy": 6.0}},
            "lifecycle": {"kind": "existence"},
        }
    )


def told(*args, **changes):
    """Return what is said of such a run."""
    experiment = experiment_of(*args, **changes)
    result = experiment.run()
    return list(otherwise(experiment.tracker, result.scans, result.tracks))


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_said_of_what_is_as_stated(seed):
    assert told(seed) == []


@pytest.mark.parametrize(("factor", "way"), [(0.01, "low"), (100.0, "high")])
def test_clutter_a_hundred_times_off_is_told_with_how_far(factor, way):
    (said,) = told(clutter_density=3e-7 * factor)
    assert 60 < float(re.search(rf"is its clutter (\S+) times too {way}", said)[1]) < 170
    assert told(clutter_density=3e-7 * factor**0.3) == []


def test_false_returns_around_a_fleet_are_not_counted_where_the_fleet_is():
    """They were said to be 10 times as many as stated, as nearly all returns lie in a small part of what the radar sees."""
    assert told(boats=FLEET, duration=80, clutter_density=1.5e-7, world={"clutter_density": 1.5e-7}) == []


@pytest.mark.parametrize(("stated", "true"), [(0.2, 0.9), (0.5, 0.9), (0.9, 0.5)])
def test_a_wrong_detection_probability_is_told_with_how_often_tracks_were_detected(stated, true):
    (said,) = told(world={"detection_probability": true}, detection_probability=stated)
    found, looks = re.search(r"radar: confirmed tracks took a return in ([\d.]+) % of (\d+) looks", said).groups()
    assert abs(float(found) / 100 - true) < 0.12
    assert int(looks) > 100
    assert ("leave their targets" in said) == (stated > true)


@pytest.mark.parametrize("sampled", [1000, 70])
@pytest.mark.parametrize(("true", "wrong"), [(0.9, False), (0.5, True)])
def test_a_streamed_run_tells_it_by_its_first_scans(true, wrong, sampled, tmp_path, monkeypatch):
    """It said nothing, as it keeps no tracks, and a run of more than 10,000 scans is streamed by itself."""
    monkeypatch.setattr(recorder, "SCANS", 20)
    monkeypatch.setattr(growing, "SAMPLED", sampled)
    found = stream(experiment_of(world={"detection_probability": true}), tmp_path / "out")
    assert ("confirmed tracks took a return in" in found.text) == wrong
    assert ("LOOKS WRONG" in found.text) == wrong


def test_clutter_is_told_before_the_detections_that_it_spoils():
    (said,) = told(world={"clutter_density": 1e-5})
    assert "too low" in said


def test_scans_of_one_time_are_looked_at_together(monkeypatch):
    """Of three sensors that look at once, and more scans than are looked at, a run ended in an IndexError."""
    experiment = vedette.load(
        {
            "source": {
                "kind": "simulation",
                "duration": 30,
                "drawn": BOATS,
                "looks": {name: {"interval": 1.0} for name in "abc"},
            },
            "sensors": dict.fromkeys("abc", RADAR | {"clutter_density": 0.0}),
            "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.3}},
            "associator": {"kind": "gnn"},
            "birth": {"kind": "from_returns", "spread": {"vx": 6.0, "vy": 6.0}},
            "lifecycle": {"kind": "m_of_n"},
        }
    )
    result = experiment.run()
    monkeypatch.setattr(in_tracks, "MOST", 50)
    assert len(in_tracks.first_of(result.scans)) == 48
    assert list(late(experiment.tracker, result.scans, result.tracks)) == []
    assert list(otherwise(experiment.tracker, result.scans, result.tracks)) == []
    together = tuple(evolve(scan, time=0.0) for scan in result.scans)
    assert len(in_tracks.first_of(together)) == 0
    assert np.all([track.confirmed.any() for track in result.tracks])


def test_a_track_that_begins_with_the_second_of_two_scans_or_ends_with_the_first_is_matched_with_these():
    """Where one of `k_best` ended so, a run ended in an IndexError: its last return was sought in the other scan."""
    at = {0.0: [0, 1], 1.0: [2, 3], 2.0: [4, 5]}
    lived = [[0.0, 0.0, 1.0, 1.0], [0.0, 1.0, 1.0, 2.0], [1.0, 2.0, 2.0, 3.0], [1.0]]
    assert [[i for _, i in in_tracks.rows_of(SimpleNamespace(times=np.array(times)), at)] for times in lived] == [
        [0, 1, 2, 3],
        [1, 2, 3, 4],
        [3, 4, 5],
        [],
    ]
