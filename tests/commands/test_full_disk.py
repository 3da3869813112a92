"""A disk that gets full while a command writes: a line says where, and how to go on; nothing half done is left."""

import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from support.reports import reports_frame
from support.results import config
from vedette.cli import main

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="files have no limit here")


def full(*command, most=6000):
    """Run a command where no file may grow beyond `most` bytes; return the one line that it tells."""
    line = f"import resource, sys; resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most})); "
    line += f"from vedette.cli import main; sys.exit(main({list(command)}))"
    done = subprocess.run([sys.executable, "-B", "-c", line], capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 2, done.stderr[-2000:]
    (told,) = done.stderr.splitlines()
    return told


@pytest.fixture
def given(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("config.json").write_text(json.dumps(config()))


@pytest.mark.costly
def test_an_export_for_rerun(given):
    """It ended with two tracebacks."""
    pytest.importorskip("rerun", reason="needs rerun-sdk, which is not installed: pip install 'vedette[rerun]'")
    assert main(["run", "config.json", "--out", "out"]) == 0
    Path("a.rrd").write_text("former")
    assert full("export", "out", "--to", "a.rrd") == "vedette: error: a.rrd: File too large"
    assert Path("a.rrd").read_text() == "former"
    assert not list(Path().glob(".*"))


@pytest.mark.costly
def test_a_smoothing_names_its_file(given):
    """It named none."""
    reports_frame(objects=6, rows=60)[0].to_csv("plots.csv", index=False)
    told = full("smooth", "plots.csv", "--workers", "1")
    assert told.startswith("vedette: error: plots-smoothed.csv: ")
    assert "File too large" in told
    assert not list(Path().glob(".*"))


@pytest.mark.costly
def test_a_tuning_names_its_folder_and_goes_on(given):
    """It named none, and did not say that what was found is kept."""
    recorded = config()
    assert main(["run", "config.json", "--out", "out"]) == 0
    recorded["source"] = {"kind": "jsonl", "path": "out/recording.jsonl"}
    Path("recorded.json").write_text(json.dumps(recorded))
    tune = ["tune", "recorded.json", "--free", "sensors.radar.sigma_range=1..30", "--starts", "1", "--out", "tuned"]
    assert full(*tune) == "vedette: error: tuned: File too large; --resume goes on from here"
    assert main([*tune, "--resume"]) == 0


@pytest.mark.costly
def test_a_disk_that_is_full_already(given):
    """No place was named: what fails first is the lock of the folder."""
    assert full("run", "config.json", "--out", "out", most=0) == "vedette: error: out: File too large"
    assert not Path("out").exists()
    assert full("new", "plugin", "road", most=0).endswith("pyproject.toml: File too large")


@pytest.mark.costly
def test_a_disk_that_gets_full_leaves_no_half_of_a_plugin(given):
    """The files before the one that did not fit stayed, and the same command was then refused."""
    assert full("new", "plugin", "road", most=800).endswith("motion.py: File too large")
    assert [path.name for path in Path().iterdir()] == ["config.json"]
    assert main(["new", "plugin", "road"]) == 0
    before = {path: path.read_bytes() for path in Path().rglob("*.*")}
    assert full("new", "plugin", "road", "--role", "birth", most=800).endswith("birth.py: File too large")
    assert {path: path.read_bytes() for path in Path().rglob("*.*")} == before
