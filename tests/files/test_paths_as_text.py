"""Files are named by a `Path` or by its text, as Python's own functions take them."""

import numpy as np
import pytest

from vedette import Recording, Scan, Space, Track, Trajectory
from vedette.types import Detections
from vedette_files import read_recording, read_series, read_tracks, write_recording, write_tracks_csv, write_tracks_jsonl

PLANE = Space.of(x="m", y="m")


def test_a_name_does_where_a_path_does(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    flags = np.ones(1)
    track = Track(1, PLANE, np.zeros(1), np.zeros((1, 2)), np.eye(2)[None], flags > 0, flags, None, (flags,), flags, flags)
    write_tracks_jsonl("tracks.jsonl", [track], PLANE)
    write_tracks_csv("tracks.csv", [track], PLANE)
    assert read_tracks("tracks.jsonl")[0].id == read_tracks(tmp_path / "tracks.jsonl")[0].id == 1
    truth = Trajectory("boat", PLANE, np.zeros(1), np.zeros((1, 2)))
    given = Recording((Scan(0.0, "radar", Detections.of([[1.0, 2.0]])),), (truth,))
    write_recording("recording.jsonl", given, {"radar": PLANE})
    assert len(read_recording("recording.jsonl")[0].scans) == 1


@pytest.mark.costly
def test_a_series_by_its_name(tmp_path, monkeypatch):
    import vedette
    from vedette.cli import main

    monkeypatch.chdir(tmp_path)
    errors = (0.6, -1.1, 0.3, 0.9, -0.4, -0.8, 1.2, -0.2)
    rows = "".join(f"{k},{5 * k + error},{3 * k - error}\n" for k, error in enumerate(errors))
    (tmp_path / "plots.csv").write_text("t,x,y\n" + rows)
    assert main(["new", "config", "plots.csv"]) == 0
    assert main(["run", "plots.toml", "--out", "out"]) == 0
    assert len(read_series("out/series.npz")["scans"]["time"]) == 8
    assert vedette.load("plots.toml").source.kind == "csv"
