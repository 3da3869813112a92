"""`vedette run --smooth` and the example of smoothing: what they write, refuse and gain."""

import json
import math
import runpy

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES, recording
from vedette.cli import main
from vedette_files import read_tracks
from vedette_report.running.smoothed import smooth_result
from vedette_report.series.recorder import recorded_run


def config(tmp_path):
    """A line of returns in a file, and a tracker for them."""
    rng = np.random.default_rng(9)
    rows = [f"{k},{k},{3.0 * k + rng.normal():.6f},{rng.normal():.6f}" for k in range(30)]
    (tmp_path / "returns.csv").write_text("\n".join(["scan,time,x,y", *rows]) + "\n")
    (tmp_path / "truth.csv").write_text("\n".join(["time,x,y", *(f"{k},{3.0 * k},0" for k in range(30))]) + "\n")
    data = {
        "source": {
            "kind": "csv",
            "path": str(tmp_path),
            "detections": {"file": "returns.csv", "time": "time", "scan": "scan", "columns": {"x": "x", "y": "y"}},
            "truth": {"file": "truth.csv", "time": "time", "columns": {"x": "x", "y": "y"}},
        },
        "estimator": {"kind": "kalman", "motion": {"kind": "constant_velocity", "sigma_accel": 0.1}},
        "sensors": {"radar": {"kind": "cartesian_position", "sigma": 1.0, "detection_probability": 0.9}},
        "associator": {"kind": "gnn"},
        "birth": {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}},
        "lifecycle": {"kind": "m_of_n"},
    }
    path = tmp_path / "line.json"
    path.write_text(json.dumps(data))
    return path


@pytest.mark.costly
def test_the_command_writes_smoothed_tracks_beside_the_filters_and_both_figures(tmp_path, capsys):
    path = config(tmp_path)
    assert main(["run", str(path), "--out", str(tmp_path / "plain"), "--json"]) == 0
    plain = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert main(["run", str(path), "--out", str(tmp_path / "both"), "--json", "--smooth"]) == 0
    found = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert found["position_rmse_m"] == plain["position_rmse_m"]
    assert found["smoothed"]["lag_s"] is None
    assert found["smoothed"]["position_rmse_m"] < 0.8 * found["position_rmse_m"]
    for name in ("tracks.csv", "tracks.jsonl"):
        assert (tmp_path / "both" / name).read_bytes() == (tmp_path / "plain" / name).read_bytes()
    experiment = vedette.load(path)
    result = experiment.run(keep_states=True)
    (track,) = vedette.smooth(experiment.tracker, result.states)
    (written,) = read_tracks(tmp_path / "both" / "smoothed.jsonl")
    np.testing.assert_array_equal(written.mean, track.mean)
    np.testing.assert_array_equal(written.cov, track.cov)
    assert "Smoothed by all later scans" in (tmp_path / "both" / "summary.txt").read_text()
    assert main(["run", str(path), "--out", str(tmp_path / "lag"), "--json", "--smooth", "0.05 min"]) == 0
    lagged = json.loads(capsys.readouterr().out.splitlines()[-1])["smoothed"]
    assert lagged["lag_s"] == 3.0
    assert found["smoothed"]["position_rmse_m"] < lagged["position_rmse_m"] < found["position_rmse_m"]


@pytest.mark.parametrize("lag", ["-1", "3 m", "soon", "inf"])
def test_the_command_refuses_a_wrong_lag_before_it_writes(tmp_path, capsys, lag):
    assert main(["run", str(config(tmp_path)), "--out", str(tmp_path / "out"), f"--smooth={lag}"]) == 2
    assert "--smooth: must be" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_example_runs_and_each_later_scan_helps(capsys):
    runpy.run_path(str(EXAMPLES / "smooth.py"))
    told = [float(line.split("RMSE")[1].split()[0]) for line in capsys.readouterr().out.splitlines()]
    assert len(told) == 3
    assert told[0] > told[1] > told[2]


@pytest.mark.costly
def test_on_recorded_radar_data_smoothing_lowers_the_error():
    """joyride, one given target, as docs/smoothing.md tells it."""
    folder = recording("joyride")
    experiment = vedette.load(
        EXAMPLES / "joyride.toml",
        overrides=[
            f"source.path={folder}",
            "lifecycle.kind=single_target",
            "birth.kind=given",
            "birth.offset.x=10.0",
            "judge.last_scan=211",
        ],
    )
    recorded = recorded_run(experiment, experiment.steps(), keep_states=True)
    found = smooth_result(experiment, recorded, math.inf).score
    before = smooth_result(experiment, recorded, 0.0).score
    assert before.position_rmse_m < 21.0
    assert found.position_rmse_m < 18.0
    assert found.velocity_rmse_mps < 0.7 * before.velocity_rmse_mps
