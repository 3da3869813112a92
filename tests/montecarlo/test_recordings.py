"""Studies on what does not vary: a recording under a filter that draws nothing gives the same run again and again."""

import json

import numpy as np
import pytest

import vedette
from vedette import ConfigError, Detections, Recording, Scan, Space
from vedette.cli import main
from vedette.io import write_recording

KALMAN = {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}}
PARTICLES = {"kind": "bootstrap_particles", "motion": {"kind": "constant_velocity", "sigma_accel": 1.0}, "particles": 100}


@pytest.fixture
def recorded(tmp_path):
    """A config on a recording of one object at rest."""
    dice = np.random.default_rng(1)
    scans = tuple(Scan(float(t), "radar", Detections.of(dice.normal(0.0, 5.0, (1, 2)))) for t in range(10))
    path = tmp_path / "recording.jsonl"
    write_recording(path, Recording(scans), {"radar": Space.of(x="m", y="m")})
    return {
        "estimator": KALMAN,
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
        "associator": {"kind": "gnn"},
        "lifecycle": {"kind": "m_of_n", "spread": {"vx": 10.0, "vy": 10.0}},
        "source": {"kind": "jsonl", "path": str(path)},
    }


def test_runs_that_would_all_be_the_same_are_refused(recorded):
    with pytest.raises(ConfigError, match=r"^runs: must be 1, got 200: neither the source \(jsonl\) nor the estimator"):
        vedette.monte_carlo(recorded, runs=200)


def test_a_grid_of_trackers_on_a_recording_takes_one_run_each(recorded):
    sweep = {"sensors.radar.sigma": [4.0, 6.0]}
    with pytest.raises(ConfigError, match="all runs would be the same"):
        vedette.monte_carlo(recorded, runs=2, sweep=sweep)
    found = vedette.monte_carlo(recorded, runs=1, sweep=sweep)
    assert [found.means(i)["nis"].error for i in range(2)] == [None, None]


def test_a_filter_that_draws_may_run_often(recorded):
    found = vedette.monte_carlo(recorded | {"estimator": PARTICLES}, runs=3)
    assert found.means(0)["nis"].error > 0


def test_the_command_says_it_in_one_line(recorded, tmp_path, capsys):
    (tmp_path / "study.json").write_text(json.dumps({"experiment": recorded, "runs": 30}))
    assert main(["study", str(tmp_path / "study.json")]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1
    assert "runs: must be 1, got 30" in told
