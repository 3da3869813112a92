"""`vedette check`: in JSON, and of what cannot be checked."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import EXAMPLES
from vedette.cli import main
from vedette.testing import laws_of
from vedette_standard.associators.nearest import Nearest
from vedette_tools.commands import check


@pytest.mark.costly
def test_the_last_line_is_the_table_in_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "nearest", "--json"]) == 0
    (component,) = json.loads(capsys.readouterr().out.splitlines()[-1])["components"]
    assert (component["role"], component["kind"], component["failed"]) == ("associator", "nearest", False)
    assert [law["law"] for law in component["laws"]] == [law.name for law in laws_of(Nearest)]
    assert {law["verdict"] for law in component["laws"]} <= {"held", "skipped"}


HOOK = "import vedette\n@vedette.plugin\ndef vedette_components(): "
CASES = {
    "an import that fails": ("raise ImportError('no tides')", "could not be imported: ImportError: no tides"),
    "no Python": ("def (", "could not be imported: SyntaxError"),
    "an import that ends the process": ("raise SystemExit(3)", "could not be imported: SystemExit: 3"),
    "a hook that fails": (HOOK + "return 1 / 0", "its vedette_components failed: ZeroDivisionError"),
    "a class of no role": (HOOK + "return [dict]", "dict plays none of the roles"),
    "a class that is incomplete": (HOOK + "return [vedette.Associator]", "Associator is incomplete"),
}


@pytest.mark.parametrize("case", CASES)
def test_what_cannot_be_checked_is_told(
    case: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    source, told = CASES[case]
    name = "vedette_test_check_" + case.split()[-1].lower() + str(len(case))
    (tmp_path / f"{name}.py").write_text(source)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check", name]) == 2
    assert told in capsys.readouterr().err


CONFIG = """
[sensors.radar]
kind = "cartesian_position"
sigma = 5.0
[estimator]
kind = "kalman"
motion = { kind = "gauss_markov_free", sigma = 1.0 }
[associator]
kind = "nearest"
[birth]
kind = "given"
start = { x = [0, 1], y = [0, 1], vx = [0, 1], vy = [0, 1] }
[lifecycle]
kind = "single_target"
"""


@pytest.mark.costly
def test_a_config_is_checked_part_by_part(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "tracker.toml"
    path.write_text(CONFIG.replace("gauss_markov_free", "constant_velocity").replace("sigma = 1.0", "sigma_accel = 1.0"))
    assert main(["check", "nearest", "--config", str(path), "--json"]) == 0
    (component,) = json.loads(capsys.readouterr().out.splitlines()[-1])["components"]
    assert component["kind"] == "nearest"
    assert [type(part).__name__ for part in check.parts_of(str(path))] == [
        *("Kalman", "ConstantVelocity", "CartesianPosition", "Nearest", "SingleTarget", "Given")
    ]
    assert main(["check", "pda", "--config", str(path)]) == 2
    assert "has none; it has cartesian_position, constant_velocity," in capsys.readouterr().err


WRONG = """
import numpy as np
from attrs import frozen
from vedette import MotionModel, Space

@frozen
class Noisy(MotionModel):
    kind = "test_noisy_warnings"
    @property
    def state(self): return Space.of(x="m")
    def move(self, x, dt):
        np.log(np.zeros(3))
        return x + 0.5
    def noise(self, x, dt): return dt * np.eye(1)
"""


@pytest.mark.costly
def test_a_counterexample_has_four_lines_and_warnings_are_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "vedette_test_noisy.py").write_text(WRONG)
    monkeypatch.syspath_prepend(str(tmp_path))
    assert main(["check", "vedette_test_noisy"]) == 1
    told = capsys.readouterr()
    lines = told.out.splitlines()
    (row,) = (i for i, line in enumerate(lines) if line.startswith("  zero_step_changes_nothing"))
    assert "failed  move(x, 0)[0, 0]: must be 0, got 0.5" in lines[row]
    assert lines[row + 1].strip().startswith("after move(x [[0.], [0.], [0.]], dt 0) -> [[0.5]")
    assert lines[row + 2].strip() == "with Noisy()"
    assert lines[row + 3].strip().startswith("and Moves(x=")
    assert "--law zero_step_changes_nothing --replay " in lines[row + 4]
    assert lines[row + 5].startswith("  noise_is_a_covariance ")
    assert "divide by zero encountered in log (vedette_test_noisy.py:12)" in lines[-2]
    assert lines[-1].strip()[0].isdigit()
    assert told.err == ""


@pytest.mark.costly
def test_what_cannot_be_drawn_is_told_with_its_cure(capsys: pytest.CaptureFixture[str]) -> None:
    for kind in ("csv", "template_filter"):
        assert main(["check", kind]) == 1
        told = capsys.readouterr().out
        assert "cannot be drawn" in told
        assert "vedette check KIND --config FILE" in told


HARBOUR = str(EXAMPLES / "harbour.toml")


def test_set_changes_the_config_whose_components_are_checked(capsys: pytest.CaptureFixture[str]) -> None:
    (radar,) = check.parts_of(HARBOUR, "range_bearing", ["sensors.radar.sigma_range=7"])
    assert getattr(radar, "sigma_range", None) == 7.0
    for given in ([HARBOUR], ["pda", "--config", HARBOUR]):
        assert main(["check", *given, "--set", "gate.probability=2"]) == 2
        assert capsys.readouterr().err == "vedette: error: gate.probability: must be > 0 and <= 1, got 2\n"
    assert main(["check", "pda", "--set", "gate.probability=0.9"]) == 2
    assert "--set: changes a config: name one" in capsys.readouterr().err


def test_a_module_of_the_folder_is_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (EXAMPLES / "plugin_template" / "src" / "vedette_road" / "time_difference.py").read_text()
    (tmp_path / "vedette_test_here.py").write_text(text)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [entry for entry in sys.path if entry])
    assert main(["check", "vedette_test_here:TimeDifference", "--law", "pure"]) == 0
    assert "pure" in capsys.readouterr().out


@pytest.mark.costly
def test_without_hypothesis_its_cure_is_told() -> None:
    code = "import sys; sys.modules['hypothesis'] = None; from vedette.cli import main; sys.exit(main(['check', 'nearest']))"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert ended.returncode == 2
    assert "vedette.testing needs hypothesis: pip install 'vedette[testing]'" in ended.stderr
