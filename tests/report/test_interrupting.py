"""Ctrl-C at any moment of a streamed run: its files hold the same scans, and say that it was interrupted."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from support import interrupting
from support.results import config


def check(runs, tmp_path):
    experiment = config()
    experiment["source"]["duration"] = 600.0
    (tmp_path / "config.json").write_text(json.dumps(experiment))
    line = [sys.executable, "-m", "support.interrupting", str(runs), "1", "config.json"]
    where = os.environ | {"PYTHONPATH": str(Path(interrupting.__file__).parents[1])}
    done = subprocess.run(line, cwd=tmp_path, env=where, capture_output=True, text=True, check=False, timeout=1800)
    assert done.returncode == 0, done.stderr[-2000:]
    found = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(found) == runs
    assert any(each["left"] for each in found)
    for each in found:
        code, left = each["code"], each["left"]
        assert code == 130 or (code == 0 and left)
        if left:  # it had begun to write results
            assert left["recorded"] == left["series"] == left["counted"]
            assert left["interrupted"] == (code == 130)


@pytest.mark.costly
def test_the_files_of_an_interrupted_run_hold_the_same_scans(tmp_path):
    check(6, tmp_path)


@pytest.mark.nightly("interrupts many runs")
def test_whenever_many_runs_are_interrupted(tmp_path):
    check(100, tmp_path)
