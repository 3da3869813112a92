"""The command line, in this process and in others: what it writes, what it says, and how it ends."""

import errno
import importlib.metadata
import json
import os
import pty
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import vedette
from vedette import metrics
from vedette.cli import main
from vedette.config.schema import schema
from vedette.io import read_tracks

DOCS = Path(__file__).parent.parent.parent / "docs" / "command-line.md"

SCENE = """
title = "Two ships"
seed = 7

[source]
kind = "simulation"
duration = 60

[source.looks.radar]
interval = 2.0
clutter.x = { low = -300, high = 900 }
clutter.y = { low = -300, high = 300 }

[source.ships.north]
start = [0, 100]
speed = 8.0

[source.ships.south]
start = [400, -100]
course = "180 deg"
speed = 5.0

[sensors.radar]
kind = "cartesian_position"
sigma = 5.0
detection_probability = 0.9
clutter_density = 4e-6

[estimator]
kind = "imm"
transition = [[0.9, 0.1], [0.1, 0.9]]

[[estimator.modes]]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 0.1 }

[[estimator.modes]]
kind = "kalman"
motion = { kind = "constant_velocity", sigma_accel = 1.0 }

[associator]
kind = "gnn"

[lifecycle]
kind = "m_of_n"
spread = { vx = 8.0, vy = 8.0 }
"""

FILES = ["config.json", "recording.jsonl", "summary.json", "summary.txt", "tracks.csv", "tracks.jsonl"]
PICTURES = ["errors.png", "picture.png"]


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "ships.toml"
    path.write_text(SCENE)
    return path


@pytest.fixture
def undrawn(monkeypatch):
    """A machine without matplotlib: what has nothing to do with pictures is quicker without."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)


def files(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def written(folder):
    return {name: data for name, data in files(folder).items() if not name.endswith(".png")}


def command(*arguments, **options):
    """`vedette` in a process of its own."""
    line = [sys.executable, "-m", "vedette", *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, timeout=300, **options)


def in_json(capsys, *arguments):
    code = main([*map(str, arguments), "--json"])
    return code, json.loads(capsys.readouterr().out.splitlines()[-1])


def documented_keys():
    section = DOCS.read_text().split("### The line of JSON")[1].split("\n### ")[0]
    return re.findall(r"^\| `(\w+)`", section, flags=re.MULTILINE)


# ---- what a run leaves


def test_a_run_leaves_its_files_and_tells_their_names(config, tmp_path, capsys):
    assert main(["run", str(config), "--out", str(tmp_path / "results")]) == 0
    told = capsys.readouterr()
    assert sorted(files(tmp_path / "results")) == sorted(FILES + PICTURES)
    assert told.err == ""
    assert all(name in told.out.splitlines()[-1] for name in FILES + PICTURES)
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


def test_processes_with_unlike_hash_seeds_write_the_same_bytes(config, tmp_path):
    for seed in ("1", "2"):
        env = {**os.environ, "PYTHONHASHSEED": seed}
        done = command("run", config, "--out", tmp_path / seed, env=env, cwd=tmp_path)
        assert (done.returncode, done.stderr) == (0, "")
    first = written(tmp_path / "1")
    assert sorted(first) == FILES
    assert first == written(tmp_path / "2")
    assert not any(str(tmp_path).encode() in data for data in first.values())


def test_the_results_can_be_run_again(config, tmp_path, undrawn):
    once, again, replayed = (tmp_path / name for name in ("once", "again", "replayed"))
    assert main(["run", str(config), "--out", str(once)]) == 0
    assert main(["run", str(once / "config.json"), "--out", str(again)]) == 0
    assert written(again) == written(once)
    source = ["--set", "source.kind=jsonl", "--set", f"source.path={once / 'recording.jsonl'}"]
    assert main(["run", str(config), *source, "--out", str(replayed)]) == 0
    for name in ("recording.jsonl", "tracks.csv", "tracks.jsonl", "summary.json", "summary.txt"):
        assert (replayed / name).read_bytes() == (once / name).read_bytes(), name


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


# ---- recordings that are not all good


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
    unknown = ["position_rmse_m", "coverage", "id_switches", "false_tracks", "gospa_m", "lost", "anees"]
    assert [figures[name] for name in unknown] == [None] * len(unknown)
    assert figures["nis"] is not None
    assert figures["truths"] == []


# ---- wrong use


WRONG = {
    "no such file": (lambda path: ["run", path.with_name("none.toml")], "there is no such file"),
    "not a config": (lambda path: ["run", path.parent], "must end in"),
    "a typo": (lambda path: ["run", path, "--set", "gate.probabilty=0.9"], "did you mean 'probability'?"),
    "a kind that is not there": (lambda path: ["run", path, "--set", "associator.kind=gn"], "did you mean 'gnn'?"),
    "a wrong sign": (lambda path: ["run", path, "--set", "sensors.radar.sigma=-1"], "must be > 0, got -1 m"),
    "an override without a value": (lambda path: ["run", path, "--set", "seed"], "--set seed"),
    "a seed that is no number": (lambda path: ["run", path, "--seed", "x"], "seed: must be a number"),
    "no recording": (
        lambda path: ["run", path, "--set", "source.kind=jsonl", "--set", "source.path=none"],
        "source.path: there is no file or folder 'none'",
    ),
    "a recording of another format": (
        lambda path: ["run", path, "--set", "source.kind=jsonl", "--set", f"source.path={path}"],
        "ships.toml:1: ",
    ),
    "an output that is a file": (lambda path: ["run", path, "--out", path], "is a file, and results need a folder"),
    "an output inside a file": (lambda path: ["run", path, "--out", path / "deep" / "er"], "is a file, and results need"),
    "no such role": (lambda path: ["components", "motions"], "did you mean 'motion'?"),
}


@pytest.mark.parametrize("case", WRONG, ids=str)
def test_what_is_wrong_is_told_without_a_traceback_before_anything_is_written(case, config, tmp_path, monkeypatch, capsys):
    arguments, expected = WRONG[case]
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert main(list(map(str, arguments(config)))) == 2
    told = capsys.readouterr()
    assert told.out == ""
    assert expected in told.err
    assert all(line.startswith("vedette: error: ") for line in told.err.splitlines())
    assert sorted(tmp_path.rglob("*")) == before


def test_all_problems_of_a_config_are_told_one_a_line(config, capsys):
    wrong = ["--set", "sensors.radar.sigma=-1", "--set", "gate.probability=2", "--set", "judge.cover_radius=0"]
    assert main(["run", str(config), *wrong]) == 2
    told = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[2] for line in told] == ["sensors.radar.sigma", "gate.probability", "judge.cover_radius"]


def test_the_process_ends_with_the_code(config, tmp_path):
    done = command("run", config, "--set", "associator.kind=gn", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "Traceback" not in done.stderr
    assert done.stderr.startswith("vedette: error: associator.kind: ")
    assert not (tmp_path / "out").exists()


def test_a_file_that_cannot_be_written_is_told(config, tmp_path, capsys, undrawn):
    (tmp_path / "results" / "tracks.csv").mkdir(parents=True)
    assert main(["run", str(config), "--out", str(tmp_path / "results")]) == 2
    assert re.fullmatch(r"vedette: error: .*tracks\.csv.*: Is a directory\n", capsys.readouterr().err)


@pytest.mark.parametrize("arguments", [[], ["fly"], ["run"], ["run", "a.toml", "--sed", "1"]])
def test_wrong_use_shows_the_usage(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage: vedette" in capsys.readouterr().err


def test_the_version_is_the_distributions(capsys):
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out == f"vedette {importlib.metadata.version('vedette')}\n"


def test_a_reader_that_goes_away_is_no_error():
    reading, writing = os.pipe()
    os.close(reading)
    line = [sys.executable, "-m", "vedette", "schema"]
    done = subprocess.run(line, stdout=writing, stderr=subprocess.PIPE, text=True, timeout=300)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, "")


# ---- third parties


ACME = '''
"""A third party's plugin: a motion model, and an associator that presses Ctrl-C when it has seen enough."""

from typing import ClassVar

import numpy as np
from attrs import frozen

import vedette
from vedette import fields


@frozen
class Drift(vedette.MotionModel):
    """Stands still but for white noise."""

    kind: ClassVar[str] = "acme_drift"

    spread: float = fields.quantity("m", "standard deviation gained in 1 s, per axis", above=0, default=2.0)
    style: str = fields.choice("of no effect", ("plain", "fancy"), default="plain")

    @property
    def state(self):
        return vedette.Space.of(x="m", y="m")

    def move(self, x, dt):
        return x

    def noise(self, x, dt):
        return self.spread**2 * dt * np.eye(2)


seen = []


@frozen
class Impatient(vedette.Associator):
    """Each track takes its best return, and after ten scans it is enough."""

    kind: ClassVar[str] = "acme_impatient"

    def associate(self, scores, evidence):
        seen.append(scores)
        if len(seen) > 10:
            raise KeyboardInterrupt
        return np.eye(scores.shape[-1])[np.argmax(scores, axis=-1)]


@vedette.plugin
def vedette_components():
    return [Drift, Impatient]
'''

DISTRIBUTIONS = {"acme": ("acme_tracking", ACME), "ruined": ("ruined_tracking", "import nowhere_to_be_found")}


@pytest.fixture
def acme(tmp_path, monkeypatch):
    """Two distributions installed beside Vedette: one that works, one whose import fails."""
    site = tmp_path / "site"
    for name, (module, source) in DISTRIBUTIONS.items():
        info = site / f"{name}-1.2.dist-info"
        info.mkdir(parents=True)
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(f"[vedette]\n{name} = {module}\n")
        (site / f"{module}.py").write_text(source)
    monkeypatch.syspath_prepend(site)
    yield site
    sys.modules.pop("acme_tracking", None)


def test_components_lists_third_parties_and_what_is_broken(acme, capsys):
    assert main(["components"]) == 0
    text = capsys.readouterr().out
    assert "  acme_drift  (acme 1.2)\n    Stands still but for white noise.\n" in text
    assert "spread  number, in m, > 0, default 2.0: standard deviation gained in 1 s, per axis" in text
    assert "one of 'plain', 'fancy', default \"plain\": of no effect" in text
    assert re.search(r"broken: plugin 'ruined' of ruined 1.2 .*nowhere_to_be_found", text)


def test_components_in_json_name_every_installed_kind(acme, capsys):
    assert main(["components", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    registry = vedette.Registry.installed()
    assert [(one["role"], one["kind"]) for one in listed["components"]] == [(one.role, one.kind) for one in registry]
    drift = next(one for one in listed["components"] if one["kind"] == "acme_drift")
    assert (drift["distribution"], drift["version"]) == ("acme", "1.2")
    assert drift["parameters"][0] == {
        "name": "spread",
        "type": "number",
        "unit": "m",
        "required": False,
        "default": 2.0,
        "limits": {"above": 0},
        "doc": "standard deviation gained in 1 s, per axis",
    }
    assert [plugin["entry_point"] for plugin in listed["broken"]] == ["ruined"]
    simulation = next(one for one in listed["components"] if one["kind"] == "simulation")
    assert {"Look", "Ship", "Leg", "Bounds"} <= set(simulation["tables"])


def test_components_of_one_role(capsys):
    assert main(["components", "motion", "--json"]) == 0
    assert {one["role"] for one in json.loads(capsys.readouterr().out)["components"]} == {"motion"}


def test_a_third_partys_motion_works_in_a_config(acme, config, tmp_path, capsys, undrawn):
    estimator = '{kind="ekf", motion={kind="acme_drift", spread=9.0}}'
    options = ["--set", f"estimator={estimator}", "--set", "lifecycle.spread={}"]
    code, figures = in_json(capsys, "run", config, *options, "--out", tmp_path / "results")
    assert code == 0
    assert figures["tracks"] > 0


def test_schema_prints_the_schema(capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(schema()))


# ---- interruption and progress


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

    monkeypatch.setattr("vedette.commands.run.check_folder", interrupt)
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


def test_a_terminal_shows_progress_and_standard_output_does_not(config, tmp_path):
    env = {**os.environ, "TERM": "xterm", "COLUMNS": "100"}
    told, out, code = with_terminal("run", config, "--out", tmp_path / "results", env=env)
    assert code == 0
    assert "tracking" in told
    assert "100%" in told
    assert "\x1b" not in out


def test_without_rich_a_terminal_gets_one_line(config, tmp_path):
    (tmp_path / "without" / "rich").mkdir(parents=True)
    (tmp_path / "without" / "rich" / "__init__.py").write_text("raise ImportError\n")
    env = {**os.environ, "PYTHONPATH": str(tmp_path / "without")}
    told, _, code = with_terminal("run", config, "--out", tmp_path / "results", env=env)
    assert code == 0
    assert told.splitlines() == ["tracking over 31 scans"]
