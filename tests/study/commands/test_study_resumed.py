"""A study that was killed after its labelled arrays were written is resumed."""

import json
from pathlib import Path

import pytest

from support.results import config
from vedette.cli import main


def contents():
    return {path: path.read_bytes() for path in Path("out").rglob("*") if path.is_file()}


@pytest.mark.costly
def test_a_study_whose_labelled_arrays_are_there_is_resumed_to_the_same(tmp_path, monkeypatch):
    pytest.importorskip("zarr")
    pytest.importorskip("xarray")
    monkeypatch.chdir(tmp_path)
    Path("study.json").write_text(json.dumps({"experiment": config(), "runs": 2, "chunk": 1}))
    line = ["study", "study.json", "--threads", "1", "--out", "out"]
    assert main(line) == 0
    whole = contents()
    assert Path("out/study.zarr").is_dir()
    Path("out/chunks/00000-0000001.npz").unlink()
    assert main([*line, "--resume"]) == 0
    assert contents() == whole
    (Path("out") / "summary.csv").unlink()
    (Path("out") / "summary.csv").mkdir()
    assert main([*line, "--resume"]) != 0  # a folder that is not ours
