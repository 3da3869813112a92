"""The new user's path: an empty folder, a foreign file, two commands; and a package for a plugin."""

import importlib
import json
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
from attrs import evolve
from jsonschema import Draft202012Validator

import vedette
from support.foreign_files import FILES, degrees, reports, ships_radar, shuffled
from support.paths import ROOT
from vedette import metrics
from vedette.cli import main
from vedette_files.georeference import Terms
from vedette_files.readers import NORTH_EAST
from vedette_standard.motion.constant_velocity import ConstantVelocity
from vedette_tools.drafting.config import draft_config
from vedette_tools.json_schema import schema

VALIDATOR = Draft202012Validator(schema(vedette.Registry.installed()))
"""What editors check a config by."""


def placed(path, notes):
    """The truth, given in east and north, as the recording's notes have x and y."""
    terms, states = Terms.of(notes), path.states.copy()
    if terms.origin is not None:
        east, north, _ = terms.origin.to_plane(*degrees(*states[:, :2].T))
        states[:, 0], states[:, 1] = east, north
    return evolve(path, states=states[:, [1, 0, 3, 2]] if notes.get("frame") == NORTH_EAST else states)


def errors(config, file):
    """The RMS error of the position in m, and the coverage, of a run over the file in the current folder."""
    experiment = vedette.load(config)
    result = experiment.run()
    truth = tuple(placed(path, result.recording.notes) for path in file.truth)
    score = metrics.judge(result.tracks, truth, result.scans, experiment.judge, experiment.tracker.gate.probability)
    return score.position_rmse_m, score.coverage


@pytest.mark.parametrize("make", FILES, ids=[make.__name__ for make in FILES])
@pytest.mark.costly
def test_from_an_empty_folder_to_tracks_on_a_map_in_two_commands(make, tmp_path, monkeypatch, capsys):
    pytest.importorskip("pymap3d")
    monkeypatch.chdir(tmp_path)
    file = make()
    Path(file.name).write_text(file.text)
    name = Path(file.name).stem
    assert main(["new", "config", file.name]) == 0
    assert f"run it: vedette run {name}.toml" in capsys.readouterr().out
    if make is not ships_radar:
        monkeypatch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)  # one picture is enough
    assert main(["run", f"{name}.toml", "--json"]) == 0
    figures = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert figures["refused"] == 0
    assert figures["tracks"] >= len(file.truth)
    made = Path("out") / name
    assert (made / ("picture.png" if make is ships_radar else "tracks.csv")).stat().st_size > 1000
    text = Path(f"{name}.toml").read_text()
    if make is ships_radar:
        sensor = tomllib.loads(text)["sensors"]["sensor"]
        assert sensor["sigma_range"] == pytest.approx(8, rel=0.15)
        assert float(sensor["sigma_bearing"].split()[0]) == pytest.approx(0.6, rel=0.15)
        assert sensor["detection_probability"] == pytest.approx(0.9, abs=0.05)
        assert sensor["clutter_per_scan"] == pytest.approx(3, abs=0.5)
        assert "140 scans, usually 2.5 s apart; 3 stretches of tracks found" in text
    if make is reports:
        assert len(json.loads((made / "tracks.geojson").read_text())["features"]) >= 3
    Path("hand.toml").write_text(file.by_hand)
    (drafted, covered), (wanted, least) = errors(f"{name}.toml", file), errors("hand.toml", file)
    assert drafted <= 1.05 * wanted
    assert covered >= least - 0.02


@pytest.mark.nightly("ten draws of three files")
def test_over_many_draws_the_error_is_within_a_twentieth(tmp_path, monkeypatch):
    """By the mean of the log ratio over ten draws of all three files: -.03, and its standard error .012."""
    pytest.importorskip("pymap3d")
    monkeypatch.chdir(tmp_path)
    ratios = []
    for make in FILES:
        for seed in range(10, 20):
            file = make(seed)
            Path(file.name).write_text(file.text)
            Path("draft.toml").write_text(draft_config(Path(file.name)))
            Path("hand.toml").write_text(file.by_hand)
            ratios.append(np.log(errors("draft.toml", file)[0] / errors("hand.toml", file)[0]))
    assert np.mean(ratios) <= np.log(1.05)


@pytest.mark.costly
def test_bearings_from_north_and_axes_that_are_swapped_are_found_by_the_data(tmp_path, monkeypatch):
    """The titles say neither that x is east nor that bearings are true: the returns lie on tracks in one reading only."""
    monkeypatch.chdir(tmp_path)
    _, *rows = ships_radar().text.splitlines()
    true = []
    for row in rows[:300]:
        time, r, b, east, north, heading = map(float, row.split(","))
        true.append(f"{time},{r},{(b + heading) % 360:.3f},{east},{north},{heading}")
    Path("d.csv").write_text("\n".join(["t,r,az,own_x,own_y,hdg", *true]) + "\n")
    found = tomllib.loads(draft_config(Path("d.csv")))["source"]
    assert found["platform"]["columns"] == {"x": "own_y", "y": "own_x"}
    assert found["frame"] == NORTH_EAST


def test_a_file_without_tracks_gets_a_config_that_runs_and_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("d.csv").write_text("t,x,y\n0,1,2\n1,2,3\n2,,\n")
    assert main(["new", "config", "d.csv", "--out", "sub/c.toml"]) == 3
    lines = Path("sub/c.toml").read_text().splitlines()
    told = [line for line in lines if "a guess: no track was found in the data" in line]
    assert [line.split()[0] for line in told] == ["sigma", "motion", "spread"]
    vedette.load("sub/c.toml").run()
    assert not list(VALIDATOR.iter_errors(tomllib.loads("\n".join(lines))))
    capsys.readouterr()
    assert main(["new", "config", "d.csv", "--out", "sub/c.toml"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["new", "config", "missing.csv"]) == 2
    assert "missing.csv" in capsys.readouterr().err


@pytest.mark.nightly("tries fifteen alternatives on many returns: 10 s")
def test_two_sensors_get_a_table_each(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rows = shuffled().text.splitlines()[1:]
    rows = [f"{row};{'lidar' if i % 2 else 'sonar 1'}" for i, row in enumerate(rows)]
    Path("d.csv").write_text("\n".join(["x;y;t_ms;sensor", *rows]) + "\n")
    text = draft_config(Path("d.csv"))
    assert set(tomllib.loads(text)["sensors"]) == {"lidar", "sonar 1"}
    assert not list(VALIDATOR.iter_errors(tomllib.loads(text)))
    Path("c.toml").write_text(text)
    assert {scan.sensor for scan in vedette.load("c.toml").run().scans} == {"lidar", "sonar 1"}


REST = {
    "sensors": {"radar": {"kind": "cartesian_position", "sigma": 5.0}},
    "associator": {"kind": "gnn"},
    "birth": {"kind": "from_returns", "spread": {"vx": 10.0, "vy": 10.0}},
    "lifecycle": {"kind": "m_of_n"},
}


def assert_moves_alike(motion, wanted):
    """Compare the template with the standard plugin's constant velocity, whose laws are tested."""
    x = np.random.default_rng(0).standard_normal((3, 4))
    for dt in (0.0, 0.5, 7.0):
        for found, known in (("move", (x, dt)), ("jacobian", (x, dt)), ("noise", (x, dt))):
            np.testing.assert_allclose(getattr(motion, found)(*known), getattr(wanted, found)(*known), atol=1e-12)


def test_a_new_plugin_keeps_its_laws(tmp_path, monkeypatch, capsys, pytestconfig):
    """Its laws are run in the nightly profile, as they take seconds; else it is compared with `constant_velocity`."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "plugin", "My Lake"]) == 0
    folder = tmp_path / "vedette-my-lake"
    assert "vedette-my-lake/src/vedette_my_lake/motion.py" in capsys.readouterr().out
    stated = tomllib.loads((folder / "pyproject.toml").read_text())["project"]
    assert stated["entry-points"]["vedette"] == {"my_lake": "vedette_my_lake"}
    assert stated["requires-python"] == tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    monkeypatch.syspath_prepend(folder / "src")
    motion = importlib.import_module("vedette_my_lake.motion").MyLakeMotion
    assert vedette.Registry.of(motion).find("motion", "my_lake_motion").summary.startswith("White-noise acceleration")
    assert vedette.build({"estimator": {"kind": "kalman", "motion": motion(0.5)}, **REST}).state.names == (
        "x",
        "y",
        "vx",
        "vy",
    )
    if pytestconfig.getoption("vedette_profile") == "nightly":
        run = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-o", "pythonpath=src"]
        done = subprocess.run(run, cwd=folder, capture_output=True, text=True, timeout=300)
        assert done.returncode == 0, done.stdout
    else:
        assert_moves_alike(motion(0.5), ConstantVelocity(0.5))
    assert main(["new", "plugin", "other", "--out", "vedette-my-lake"]) == 2
    assert "exists already and is not" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["", "9lives", "a/b", "class", "../up"])
def test_a_name_that_is_none_is_refused(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["new", "plugin", name]) == 2
    assert "must be a word of letters" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())
