"""`vedette run`: what it writes and says, also of a recording with bad parts."""

import json
import os
import re

import attrs
import numpy as np
import pytest

import vedette
from support.commands import FILES, command, files, in_json
from support.paths import DOCS
from vedette import metrics
from vedette.cli import main
from vedette_files import read_tracks

PICTURES = ["errors.png", "picture.png"]


def written(folder):
    return {name: data for name, data in files(folder).items() if not name.endswith(".png")}


def documented_keys():
    section = (DOCS / "reference" / "json.md").read_text().split("## run")[1].split("\n## ")[0]
    before, after = section.split("| `scans` to `position_bound_m` |")
    own = [re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE) for part in (before, after)]
    names = [field.name for field in attrs.fields(metrics.Score) if field.name not in ("more", "truths")]
    assert (names[0], names[-1]) == ("scans", "position_bound_m")
    return [*own[0], *names, *own[1]]


def test_a_run_leaves_its_files_and_tells_their_names(config, tmp_path, capsys):
    assert main(["run", str(config), "--all", "--out", str(tmp_path / "results")]) == 0
    told = capsys.readouterr()
    assert sorted(files(tmp_path / "results")) == sorted(FILES + PICTURES)
    assert told.err == ""
    assert all(name in told.out.splitlines()[-1] for name in FILES + PICTURES)
    tracked, beside = re.search(r"^(\S+) ms a scan to track, (\S+) to read", told.out, re.MULTILINE).groups()
    assert float(beside) > float(tracked) > 0  # this run's files and pictures take longer than its tracks
    assert (tmp_path / "results" / "summary.txt").read_text() in told.out


def test_the_last_line_has_the_documented_keys_in_order(config, tmp_path, capsys, undrawn):
    code, figures = in_json(capsys, "run", config, "--out", tmp_path / "results")
    assert code == 0
    assert list(figures) == documented_keys()
    stored = json.loads((tmp_path / "results" / "summary.json").read_text())
    assert stored == {name: figures[name] for name in documented_keys() if not name.startswith("seconds")}
    assert figures["seconds_per_scan"] == pytest.approx(figures["seconds"] / figures["scans_taken"])


def test_the_figures_are_those_of_the_experiment(config, tmp_path, capsys, undrawn):
    _, figures = in_json(capsys, "run", config, "--out", tmp_path / "results")
    experiment = vedette.load(config)
    result = experiment.run()
    gate = experiment.tracker.gate.probability
    judged = metrics.judge(result.tracks, result.recording.truth, result.scans, experiment.judge, gate)
    assert figures["position_rmse_m"] == judged.position_rmse_m
    assert figures["nis"] == judged.nis
    assert [one["name"] for one in figures["truths"]] == ["north", "south"]
    assert (figures["scans_taken"], figures["tracks"], figures["begun"]) == (31, len(result.tracks), result.begun)
    again = read_tracks(tmp_path / "results" / "tracks.jsonl")
    assert [track.id for track in again] == [track.id for track in result.tracks]
    np.testing.assert_array_equal(again[0].mean, result.tracks[0].mean)


@pytest.mark.costly
def test_processes_with_unlike_hash_seeds_write_the_same_bytes(config, tmp_path):
    for seed in ("1", "2"):
        env = {**os.environ, "PYTHONHASHSEED": seed}
        done = command("run", config, "--out", tmp_path / seed, env=env, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
    first = written(tmp_path / "1")
    assert sorted(first) == FILES
    assert first == written(tmp_path / "2")
    assert not any(str(tmp_path).encode() in data for data in first.values())


@pytest.mark.costly
def test_the_results_can_be_run_again(config, tmp_path, undrawn):
    once, again, replayed = (tmp_path / name for name in ("once", "again", "replayed"))
    assert main(["run", str(config), "--out", str(once)]) == 0
    assert main(["run", str(once / "config.json"), "--out", str(again)]) == 0
    assert written(again) == written(once)
    source = ["--set", "source.kind=jsonl", "--set", f"source.path={once / 'recording.jsonl'}"]
    assert main(["run", str(config), *source, "--out", str(replayed)]) == 0
    for name in ("recording.jsonl", "tracks.csv", "tracks.jsonl", "summary.json", "summary.txt"):
        assert (replayed / name).read_bytes() == (once / name).read_bytes(), name


@pytest.mark.costly
def test_the_seed_comes_after_the_overrides_and_changes_the_scene(config, tmp_path, undrawn):
    runs = {"none": [], "set": ["--set", "seed=8"], "option": ["--set", "seed=9", "--seed", "8"]}
    for name, options in runs.items():
        assert main(["run", str(config), *options, "--out", str(tmp_path / name)]) == 0
    found = {name: written(tmp_path / name) for name in runs}
    assert found["set"] == found["option"]
    assert found["set"]["tracks.csv"] != found["none"]["tracks.csv"]


def test_the_default_folder_has_the_configs_name(config, tmp_path, monkeypatch, undrawn):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "ships.toml"]) == 0
    assert sorted(files(tmp_path / "out" / "ships")) == FILES


def test_without_matplotlib_all_else_is_written_and_one_line_says_so(config, tmp_path, capsys, undrawn):
    assert main(["run", str(config), "--out", str(tmp_path / "results")]) == 0
    assert sorted(files(tmp_path / "results")) == FILES
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 1
    assert "pip install 'vedette[report]'" in told[0]


@pytest.fixture
def damaged(config, tmp_path, capsys, undrawn):
    """A recording with one bad line, one bad return, and no truth."""
    assert main(["run", str(config), "--out", str(tmp_path / "whole")]) == 0
    header, *lines = (tmp_path / "whole" / "recording.jsonl").read_text().splitlines()
    scans = [line for line in lines if '"sensor"' in line]
    fourth = json.loads(scans[3])
    scans[3] = json.dumps(fourth | {"z": [*fourth["z"], [None, 1.0]]})
    scans[5] = scans[5][:20]
    header = json.dumps(json.loads(header) | {"truth": {}})
    path = tmp_path / "damaged.jsonl"
    path.write_text("\n".join([header, *scans]) + "\n")
    capsys.readouterr()
    return ["--set", "source.kind=jsonl", "--set", f"source.path={path}"]


def test_bad_parts_are_counted_named_and_skipped(config, damaged, tmp_path, capsys):
    code, figures = in_json(capsys, "run", config, *damaged, "--out", tmp_path / "results")
    assert (code, figures["refused"], figures["scans_taken"]) == (0, 2, 30)
    text = (tmp_path / "results" / "summary.txt").read_text()
    assert "2 parts of the input left out" in text
    assert "damaged.jsonl:5" in text
    assert "damaged.jsonl:7" in text
    assert figures["tracks"] > 0
    assert str(tmp_path) not in text


def test_strict_stops_there_and_writes_nothing(config, damaged, tmp_path, capsys):
    assert main(["run", str(config), *damaged, "--strict", "--out", str(tmp_path / "results")]) == 2
    assert "vedette: error: damaged.jsonl:5" in capsys.readouterr().err
    assert not (tmp_path / "results").exists()


def test_without_truth_its_figures_are_null(config, damaged, tmp_path, capsys):
    _, figures = in_json(capsys, "run", config, *damaged, "--out", tmp_path / "results")
    assert list(figures) == documented_keys()
    unknown = ["position_rmse_m", "coverage", "id_switches", "false_tracks", "gospa_m", "lost", "nees_position"]
    assert [figures[name] for name in unknown] == [None] * len(unknown)
    assert figures["nis"] is not None
    assert figures["truths"] == []
