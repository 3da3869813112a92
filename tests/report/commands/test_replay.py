"""What a run leaves behind can be run again by the same tracker to the same tracks, also behind a detector."""

import json

import pytest

from support.paths import EXAMPLES
from vedette.cli import main

CASES = {
    "vts/immcvca.toml": ["source.duration=120"],
    "bayes_risk/proposed.toml": ["source.duration=12"],
    "bayes_risk/imm_tuned.toml": ["source.duration=12"],
    "target_oriented/tom_literal.toml": ["source.duration=20"],
    "marine_picture.toml": ["source.frames=12", "source.lost=0"],
}
"""Filters of the papers, behind a detector and without one, and what makes their runs short."""
SAME = ("tracks.csv", "tracks.jsonl", "recording.jsonl")


def overrides(*settings):
    return [word for setting in settings for word in ("--set", setting)]


@pytest.mark.costly
@pytest.mark.parametrize(("example", "stream"), [*((name, []) for name in CASES), ("vts/immcvca.toml", ["--stream"])])
def test_a_recording_is_run_again_to_the_same_tracks(example, stream, tmp_path, undrawn, capsys):
    if example.startswith("marine"):
        pytest.importorskip("cv2")
    once, again = tmp_path / "once", tmp_path / "again"
    assert main(["run", str(EXAMPLES / example), *overrides(*CASES[example]), *stream, "--out", str(once)]) == 0
    source = overrides("source.kind=jsonl", f"source.path={once / 'recording.jsonl'}")
    assert main(["run", str(once / "config.json"), *source, *stream, "--out", str(again)]) == 0, capsys.readouterr().err
    for name in SAME:
        assert (again / name).read_bytes() == (once / name).read_bytes(), name
    assert len((once / "tracks.csv").read_text().splitlines()) > 5


@pytest.fixture
def recorded(tmp_path, undrawn):
    """The recording of a run behind the converted measurements of a polar radar."""
    folder = tmp_path / "once"
    assert main(["run", str(EXAMPLES / "vts/cvkf.toml"), *overrides("source.duration=60"), "--out", str(folder)]) == 0
    return folder / "recording.jsonl"


def test_the_header_says_which_scans_a_detector_made(recorded):
    header, *_ = recorded.read_text().splitlines()
    assert json.loads(header)["detected"] == ["radar"]


def replayed(recorded, tmp_path, *settings):
    source = overrides("source.kind=jsonl", f"source.path={recorded}", *settings)
    return main(["run", str(recorded.parent / "config.json"), *source, "--out", str(tmp_path / "again")])


def test_without_the_mark_the_detector_runs_and_finds_none_of_its_scans(recorded, tmp_path, capsys):
    """The error that every replay ended with."""
    header, *lines = recorded.read_text().splitlines(keepends=True)
    fields = json.loads(header)
    del fields["detected"]
    recorded.write_text(json.dumps(fields) + "\n" + "".join(lines))
    assert replayed(recorded, tmp_path) == 2
    assert "holds no usable scan of 'antenna', but of 'radar'" in capsys.readouterr().err


def test_scans_over_other_axes_than_the_tracker_measures_are_refused(recorded, tmp_path, capsys):
    recorded.write_text(recorded.read_text().replace('"radar": {"x": "m", "y": "m"}', '"radar": {"y": "m", "x": "m"}', 1))
    assert replayed(recorded, tmp_path) == 2
    told = capsys.readouterr().err
    assert "sensors.radar: the recording's scans of it are over" in told


def test_the_mark_names_sensors(recorded, tmp_path, capsys):
    recorded.write_text(recorded.read_text().replace('"detected": ["radar"]', '"detected": ["sonar"]', 1))
    assert replayed(recorded, tmp_path) == 2
    assert "detected must be names of the header's sensors, got" in capsys.readouterr().err


def test_a_tracker_without_a_detector_takes_them_too(recorded, tmp_path):
    config = json.loads((recorded.parent / "config.json").read_text())
    del config["preprocessors"]
    (recorded.parent / "config.json").write_text(json.dumps(config))
    assert replayed(recorded, tmp_path) == 0
    tracks = (recorded.parent / "tracks.csv").read_bytes()
    assert (tmp_path / "again" / "tracks.csv").read_bytes() == tracks
