"""A reader that goes away before the end, as `| head` does, costs no results: files are written before they are told."""

import io
import json
import sys
from pathlib import Path

import pytest

from support.clusters import CV, boat
from vedette.cli import main

BIRTH = {"birth": {"kind": "from_returns", "spread": {"vx": 9.0, "vy": 9.0}}, "lifecycle": {"kind": "m_of_n"}}
TUNE = ["tune", "config.json", "--out", "out"]
WRITTEN = {
    "consistency": (["consistency", "config.json", "--out", "out"], "consistency.json"),
    "tune": ([*TUNE, "--free", "sensors.radar.sigma_range=1..9", "--starts", "1"], "tuned.json"),
    "tune by place": ([*TUNE, "--detection", "sensors.radar=1x2"], "tuned.json"),
    "study": (["study", "study.json", "--threads", "1", "--write", "judged.json", "--out", "out"], "summary.json"),
    "reproduce": (["reproduce", "vts", "--runs", "2", "--out", "out"], "study.json"),
}


class Gone(io.StringIO):
    """A pipe whose reader has closed it."""

    def write(self, text):
        raise BrokenPipeError


@pytest.mark.parametrize("command", WRITTEN)
@pytest.mark.by_turns
def test_all_is_written_although_nobody_reads(command, tmp_path, monkeypatch, undrawn):
    """Tables of hours were printed first, and then not written."""
    monkeypatch.chdir(tmp_path)
    radar = {"kind": "range_bearing", "sigma_range": 5.0, "sigma_bearing": 0.01, "detection_probability": 0.9}
    filtered = {"kind": "ekf", "motion": CV}
    given = boat(40) | {"sensors": {"radar": radar}, "estimator": filtered} | ({} if command == "study" else BIRTH)
    Path("config.json").write_text(json.dumps(given))
    Path("study.json").write_text(json.dumps({"experiment": given, "runs": 2}))
    line, name = WRITTEN[command]
    monkeypatch.setattr(sys, "stdout", Gone())
    assert main(line) == 141
    assert json.loads((Path("out") / name).read_text())
    assert Path("judged.json").exists() == (command == "study")
