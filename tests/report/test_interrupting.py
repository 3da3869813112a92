"""Ctrl-C at any moment of a run: its files hold the same scans, and say that it was interrupted."""

import json
import os
import signal
import subprocess
import sys
import zlib
from functools import partial
from pathlib import Path

import pytest

from support import interrupting
from support.results import config
from vedette.cli import main
from vedette.tracking.intake import Intake
from vedette_report.commands import run
from vedette_report.drawing import brought


def check(runs, tmp_path, *options):
    experiment = config()
    experiment["source"]["duration"] = 100.0
    (tmp_path / "config.json").write_text(json.dumps(experiment))
    line = [sys.executable, "-m", "support.interrupting", str(runs), "1", "config.json", *options]
    where = os.environ | {"PYTHONPATH": str(Path(interrupting.__file__).parents[1])}
    done = subprocess.run(line, cwd=tmp_path, env=where, capture_output=True, text=True, check=False, timeout=1800)
    assert done.returncode == 0, done.stderr[-2000:]
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(found) == runs
    assert any(each["left"] for each in found)
    for each in found:
        code, left = each["code"], each["left"]
        assert code == 130 or (code == 0 and left), done.stderr[-2000:]
        if left:  # it had begun to write results
            assert left["recorded"] == left["series"] == left["counted"]
            assert code == 130 or not left["interrupted"]


@pytest.mark.costly
@pytest.mark.parametrize("options", [[], ["--stream"]])
def test_the_files_of_an_interrupted_run_hold_the_same_scans(tmp_path, options):
    check(6, tmp_path, *options)


@pytest.mark.nightly("interrupts many runs")
@pytest.mark.parametrize("options", [[], ["--stream"]])
def test_whenever_many_runs_are_interrupted(tmp_path, options):
    check(100, tmp_path, *options)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # Python 3.13 closes half a member later
@pytest.mark.parametrize("options", [[], ["--stream"]])
def test_what_a_library_raises_over_ctrl_c_is_ctrl_c(tmp_path, monkeypatch, capsys, options):
    """It comes within a member of an archive, which zipfile then finds open: a run ended with a traceback, and 1."""

    def pressed(*given, **named):
        raise KeyboardInterrupt

    monkeypatch.setattr(zlib, "compressobj", pressed)
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "config.json"), *options, "--out", str(tmp_path / "out")]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "vedette: interrupted"
    assert not (tmp_path / "out" / "summary.json").exists()


def test_pictures_that_are_interrupted_cost_no_other_file(tmp_path, monkeypatch, capsys):
    """They take longer than most runs do: with Ctrl-C then, nothing was left of all scans."""

    def pressed(*given):
        raise KeyboardInterrupt

    monkeypatch.setattr(brought, "save", pressed)
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / "out")]) == 130
    assert "pictures" in capsys.readouterr().err
    found = interrupting.left(tmp_path / "out")
    assert found["recorded"] == found["series"] == found["counted"] > 0
    assert not found["interrupted"]


TERMINATED = """
import os, signal, sys
from vedette.cli import main
from vedette_report.drawing import brought
brought.save = lambda *given: os.kill(os.getpid(), signal.SIGTERM)
sys.exit(main(["run", "config.json", "--out", "out"]))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="there SIGTERM cannot be heard")
@pytest.mark.costly
def test_a_run_that_is_terminated_ends_as_by_ctrl_c(tmp_path):
    """As batch systems and `timeout` do: nothing was left of all scans but a lock."""
    (tmp_path / "config.json").write_text(json.dumps(config()))
    done = subprocess.run([sys.executable, "-c", TERMINATED], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 130, done.stderr
    found = interrupting.left(tmp_path / "out")
    assert found["recorded"] == found["series"] == found["counted"] > 0
    assert not list((tmp_path / "out").glob(".*"))


def test_a_run_whose_last_scan_is_tracked_writes_its_files_first(tmp_path, monkeypatch, capfd):
    """Ctrl-C while it is judged cost all scans; a second one leaves none, as before."""
    judged = run.figures

    def pressed(*given, times=1):
        for _ in range(times):
            os.kill(os.getpid(), signal.SIGINT)
        return judged(*given)

    (tmp_path / "config.json").write_text(json.dumps(config()))
    for times, name in ((1, "out"), (2, "twice")):
        monkeypatch.setattr(run, "figures", partial(pressed, times=times))
        assert main(["run", str(tmp_path / "config.json"), "--out", str(tmp_path / name)]) == 130
        assert "first" in capfd.readouterr().err
    found = interrupting.left(tmp_path / "out")
    assert found["recorded"] == found["series"] == found["counted"] > 0
    assert not found["interrupted"]
    assert not list((tmp_path / "out").glob("*.png"))
    assert interrupting.left(tmp_path / "twice") is None
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("options", [[], ["--stream"]])
@pytest.mark.by_turns
def test_a_scan_that_was_counted_is_written(tmp_path, monkeypatch, options):
    """Ctrl-C comes when the fifth scan is counted, and not handed out yet."""
    count = Intake.add

    def counted(self, *scan):
        count(self, *scan)
        if self.scans == 5:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(Intake, "add", counted)
    (tmp_path / "config.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "config.json"), *options, "--out", str(tmp_path / "out")]) == 130
    assert interrupting.left(tmp_path / "out") == {"recorded": 5, "series": 5, "counted": 5, "interrupted": True}
