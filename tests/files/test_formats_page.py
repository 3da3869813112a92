"""docs/formats.md holds what is so: its examples are read."""

import re
import tomllib

import pytest

import vedette
from support.paths import DOCS
from vedette_files import AutoferrySource, CsvSource, read_recording, read_tracks

DOC = (DOCS / "formats.md").read_text(encoding="utf-8")
TRACKER = {
    "estimator": {"kind": "ekf", "motion": {"kind": "constant_velocity", "sigma_accel": 1}},
    "sensors": {"radar": {"kind": "range_bearing", "sigma_range": 1, "sigma_bearing": 0.1}},
    "associator": {"kind": "pda"},
    "birth": {"kind": "from_returns", "spread": {"vx": 1, "vy": 1}},
    "lifecycle": {"kind": "m_of_n"},
}


def examples(language):
    return re.findall(rf"```{language}\n(.*?)```", DOC, re.DOTALL)


@pytest.mark.parametrize(("example", "source"), [*zip(examples("toml"), [CsvSource, AutoferrySource], strict=True)])
def test_the_configs_build(example, source):
    assert isinstance(vedette.load(TRACKER | tomllib.loads(example)).source, source)


def test_the_recording_and_the_tracks_are_read(tmp_path):
    header, lines, left_out, tracks, end = examples("json")
    (tmp_path / "r.jsonl").write_text(header + lines)
    recording, _ = read_recording(tmp_path / "r.jsonl")
    assert recording.refused == ()
    (tmp_path / "s.jsonl").write_text(header + lines + left_out)
    again, _ = read_recording(tmp_path / "s.jsonl")
    assert (len(again.scans), len(again.refused)) == (len(recording.scans), 1)
    assert [len(scan.detections.z) for scan in recording.scans] == [2, 0]
    assert [true.name for true in recording.truth] == ["ferry"]
    (tmp_path / "t.jsonl").write_text(tracks + end)
    assert [(track.id, track.merged) for track in read_tracks(tmp_path / "t.jsonl")] == [(1, (5.0, 4))]
