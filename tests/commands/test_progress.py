"""Interruption, and progress on a terminal."""

import errno
import os
import pty
import subprocess
import sys

import numpy as np
import pytest

from support.commands import FILES, files, in_json
from vedette.cli import main
from vedette_files import read_tracks


def test_an_interrupted_run_keeps_what_is_done(acme, config, tmp_path, capsys, undrawn):
    options = ["--set", "associator.kind=acme_impatient", "--out", tmp_path / "results"]
    code, figures = in_json(capsys, "run", config, *options)
    assert (code, figures["interrupted"], figures["scans_taken"]) == (130, True, 10)
    assert sorted(files(tmp_path / "results")) == FILES
    assert "after 10 scans; the recording has 31" in (tmp_path / "results" / "summary.txt").read_text()
    times = np.concatenate([track.times for track in read_tracks(tmp_path / "results" / "tracks.jsonl")])
    assert times.max() == 18.0
    assert (tmp_path / "results" / "recording.jsonl").read_text().count('"sensor"') == 10


def test_an_interruption_elsewhere_ends_with_its_code(config, monkeypatch, capsys):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("vedette_report.commands.run.check_folder", interrupt)
    assert main(["run", str(config)]) == 130
    assert capsys.readouterr().err == "vedette: interrupted\n"


def with_terminal(*arguments, env):
    """What a command writes to a terminal on standard error, and its completed process."""
    ours, theirs = pty.openpty()
    line = [sys.executable, "-m", "vedette", *map(str, arguments)]
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=theirs, text=True, env=env)
    os.close(theirs)
    told = b""
    try:
        while part := os.read(ours, 65536):
            told += part
    except OSError as error:
        if error.errno != errno.EIO:  # how Linux says that the other end is closed
            raise
    os.close(ours)
    out, _ = process.communicate(timeout=300)
    return told.decode(), out, process.returncode


@pytest.mark.costly
def test_a_terminal_shows_progress_and_standard_output_does_not(config, tmp_path):
    env = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    told, out, code = with_terminal("run", config, "--out", tmp_path / "results", env=env)
    assert code == 0
    assert "tracking" in told
    assert "100%" in told
    assert "\x1b" not in out


@pytest.mark.costly
def test_without_rich_a_terminal_gets_one_line(config, tmp_path):
    (tmp_path / "without" / "rich").mkdir(parents=True)
    (tmp_path / "without" / "rich" / "__init__.py").write_text("raise ImportError\n")
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "without")}
    told, _, code = with_terminal("run", config, "--out", tmp_path / "results", env=env)
    assert code == 0
    assert told.splitlines() == ["tracking: 31 to go"]
