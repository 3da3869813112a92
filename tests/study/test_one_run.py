"""The config of one run given as a study, and a study given as a config: each is told what it is and how to go on."""

import re

import pytest

import vedette
from support.paths import EXAMPLES
from vedette.cli import main
from vedette.errors import ConfigError
from vedette_study.plan import plan

START = "{ x = [0, 10], y = [0, 10], vx = [5, 2], vy = [3, 2] }"
MOTION = '{ kind = "constant_velocity", sigma_accel = 0.5 }'
BOAT = f"{{ models = [{MOTION}], start = {START} }}"
ONE_RUN = f"""
source = {{ kind = "simulation", duration = 5, looks.radar.interval = 1, drawn.boat = {BOAT} }}
sensors.radar = {{ kind = "cartesian_position", sigma = 5.0 }}
estimator = {{ kind = "kalman", motion = {MOTION} }}
associator.kind = "pda"
lifecycle.kind = "single_target"
birth = {{ kind = "given", start = {START} }}
"""


def test_a_config_of_one_run_is_told_how_to_become_a_study(tmp_path, capsys, monkeypatch):
    """What the message says to write is a study that can be planned."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "boat.toml").write_text(ONE_RUN)
    assert main(["study", "boat.toml"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("vedette: error: boat.toml: is the config of one run, not a study")
    assert "unknown" not in said
    parts = re.search(r'(experiment = "\S+"), .*(runs = \d+) and (sweep = \{.*\})', said).groups()
    (tmp_path / "study.toml").write_text("\n".join(parts).replace("100", "2"))
    assert main(["study", "study.toml", "--threads", "1"]) == 0
    with pytest.raises(ConfigError, match="is the config of one"):
        plan(vedette.to_config(vedette.load("boat.toml")))


def test_a_study_given_as_a_config_is_called_one(capsys):
    for command in ("run", "check", "explain"):
        assert main([command, str(EXAMPLES / "study.toml")]) == 2
        assert "experiment: this file is a study" in (capsys.readouterr().err)
