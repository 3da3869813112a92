"""`vedette study` takes `--set` as `vedette run` does."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import vedette
from vedette.cli import main
from vedette_study.grid import short_names
from vedette_study.plan import plan

START = {"x": [0, 10], "y": [0, 10], "vx": [5, 2], "vy": [3, 2]}
CV = {"kind": "constant_velocity", "sigma_accel": 0.5}
EXPERIMENT: dict[str, Any] = {
    "source": {
        "kind": "simulation",
        "duration": 5,
        "looks": {"radar": {"interval": 1, "first": 1}},
        "drawn": {"boat": {"models": [CV], "start": START}},
    },
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "estimator": {"kind": "kalman", "motion": CV},
    "associator": {"kind": "nearest"},
    "birth": {"kind": "given", "start": START},
    "lifecycle": {"kind": "single_target"},
}
SIGMA = "sensors.radar.sigma"


def study(folder: Path, **more: Any) -> Path:
    path = folder / "study.json"
    path.write_text(json.dumps({"experiment": EXPERIMENT, "runs": 8, **more}))
    return path


def found(capsys: pytest.CaptureFixture[str], *arguments: object) -> Any:
    assert main(["study", *map(str, arguments), "--threads", "1", "--json"]) == 0
    return json.loads(capsys.readouterr().out.splitlines()[-1])["table"]


def test_it_changes_the_experiment(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = study(tmp_path)
    as_it_is, changed = found(capsys, path), found(capsys, path, "--set", f"{SIGMA}=9.0")
    by_hand = {**EXPERIMENT, "sensors": {"radar": {"kind": "cartesian_position", "sigma": 9.0}}}
    path.write_text(json.dumps({"experiment": by_hand, "runs": 8}))
    assert changed == found(capsys, path) != as_it_is


def test_the_grid_is_laid_over_it() -> None:
    planned = plan(
        {"experiment": EXPERIMENT, "sweep": {SIGMA: [4.0, 5.0]}}, [f"{SIGMA.rsplit('.', 1)[0]}.detection_probability=0.9"]
    )
    assert [point.config["sensors"]["radar"]["sigma"] for point in planned.points] == [4.0, 5.0]
    assert {point.config["sensors"]["radar"]["detection_probability"] for point in planned.points} == {0.9}


@pytest.mark.parametrize(
    ("more", "override", "told"),
    [
        ({}, "gate.probabilty=0.9", "did you mean 'probability'"),
        ({}, "sensors.radra.sigma=3", "--set sensors.radra.sigma=3: there is no sensors.radra; did you mean 'radar'?"),
        ({"sweep": {SIGMA: [1.0]}}, f"{SIGMA}=3", f"--set {SIGMA}=3: has no effect: the study sets sweep.{SIGMA}"),
        ({"trackers": {"a": {"estimator.motion": CV}}}, "estimator.motion.sigma_accel=3", "trackers.a.estimator.motion"),
    ],
)  # fmt: skip
def test_a_wrong_one_is_told(
    more: dict[str, Any], override: str, told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["study", str(study(tmp_path, **more)), "--set", override]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(
    ("path", "value", "swept"), [(SIGMA, 3.0, SIGMA), ("estimator.motion.sigma_accel", 2.0, "estimator.motion")]
)
def test_what_a_tracker_changes_is_not_swept(path: str, value: float, swept: str) -> None:
    study = {
        "experiment": EXPERIMENT,
        "trackers": {"a": {}, "b": {path: value}},
        "sweep": {swept: [CV if swept != SIGMA else 1.0]},
    }
    with pytest.raises(vedette.ConfigError, match=rf"trackers.b.{path}.*sweep.{swept}"):
        plan(study)


def test_labels_are_as_short_as_they_can_be() -> None:
    assert short_names(["associator.kind", "estimator.kind"]) == {
        "associator.kind": "associator",
        "estimator.kind": "estimator",
    }
    paths = ["sensors.radar.sigma", "sensors.lidar.sigma", "gate.probability", "tracker"]
    assert list(short_names(paths).values()) == ["radar.sigma", "lidar.sigma", "probability", "tracker"]
    assert list(short_names(["a.x.sigma", "b.x.sigma"]).values()) == ["a.x.sigma", "b.x.sigma"]
    assert list(short_names(["look.time"], {"time"}).values()) == ["look.time"]
    point = plan({"experiment": EXPERIMENT, "sweep": {"associator.kind": ["nearest"]}}).points[0]
    assert point.name == "associator nearest"
    assert vedette.monte_carlo(EXPERIMENT, 2).plan.points[0].name == "the config"
