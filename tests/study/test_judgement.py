"""Figures are kept draw by draw, and one that is worse than chance explains ends a study with 1."""

import json

import numpy as np
import pytest
from attrs import evolve

from study import test_recordings as buoys
from support.paths import EXAMPLES, ROOT, recording
from vedette.cli import main
from vedette_study.chunk import study_figures
from vedette_study.judgement import ALPHA, MORE, UNJUDGED, _compared, _holm

KEPT = ROOT / "tests" / "judgements"
LESS = {"better": "less", "least": 1e-9}


def said(capsys):
    return capsys.readouterr().out.splitlines()


@pytest.mark.costly
@pytest.mark.parametrize("name", ["study", "harbour", "doppler", "fleet"])
def test_our_trackers_are_no_worse_than_they_were(name, capsys):
    """After a change that is meant to change figures: `vedette study examples/NAME.toml --runs N --write ...`."""
    code = main(["study", str(EXAMPLES / f"{name}.toml"), "--threads", "1", "--against", str(KEPT / f"{name}.json")])
    worse = [line for line in said(capsys) if line.startswith("WORSE")]
    assert (code, worse) == (0, [])


@pytest.mark.nightly("recordings, ten draws")
@pytest.mark.parametrize(("name", "scenarios"), [("joyride", ()), ("autoferry", (2, 5, 13, 16))])
def test_our_trackers_are_no_worse_on_recordings(name, scenarios, tmp_path, capsys):
    """Each draw leaves out a tenth of the returns. After a change of figures: write `study.json`'s judgement anew."""
    more = {"average": ["source.scenario"], "sweep": {"source.scenario": scenarios}} if scenarios else {}
    study = tmp_path / "study.json"
    study.write_text(json.dumps({"experiment": str(EXAMPLES / f"{name}.toml"), "runs": 10} | more))
    against = ["--threads", "1", "--against", str(KEPT / f"{name}.json"), "--set", f"source.path={recording(name)}"]
    code = main(["study", str(study), *against])
    assert (code, [line for line in said(capsys) if line.startswith("WORSE")]) == (0, [])
    assert main(["study", str(study), *against, "--set", "gate.probability=0.3"]) == 1


@pytest.mark.costly
def test_a_study_that_averages_over_recordings_is_judged_by_its_averages(tmp_path, capsys):
    paths = [buoys.recording(tmp_path / f"{seed}.jsonl", seed) for seed in (1, 2)]
    table = buoys.table(buoys.config(paths[0]), runs=3, sweep={"source.path": paths}, average=["source.path"])
    study, kept = tmp_path / "study.json", str(tmp_path / "kept.json")
    study.write_text(json.dumps(table))
    assert main(["study", str(study), "--threads", "1", "--write", kept]) == 0
    assert main(["study", str(study), "--threads", "1", "--against", kept]) == 0
    assert any(line.startswith("fine") for line in said(capsys))


@pytest.mark.costly
def test_a_worse_tracker_is_told_and_ends_with_1(tmp_path, capsys):
    config, kept = str(EXAMPLES / "harbour.toml"), str(tmp_path / "kept.json")
    assert main(["study", config, "--runs", "4", "--threads", "1", "--write", kept]) == 0
    assert main(["study", config, "--threads", "1", "--against", kept]) == 0
    assert not [line for line in said(capsys) if line.startswith("WORSE")]
    blunt = ["--set", "gate.largest_distance=0.7"]
    assert main(["study", config, *blunt, "--threads", "1", "--against", kept]) == 1
    (first, *_) = [line for line in said(capsys) if line.startswith("WORSE")]
    assert "before" in first
    patient = json.loads((tmp_path / "kept.json").read_text())
    for rule in patient["figures"].values():
        rule["least"] = 1e6
    (tmp_path / "patient.json").write_text(json.dumps(patient))
    capsys.readouterr()
    main(["study", config, *blunt, "--threads", "1", "--against", str(tmp_path / "patient.json")])
    assert all(" 0 before" in line for line in said(capsys) if line.startswith("WORSE"))  # of nothing, any part is more


def test_a_judgement_of_something_else_is_refused(tmp_path, capsys):
    config = str(EXAMPLES / "doppler.toml")
    (tmp_path / "none.json").write_text("{}")
    assert main(["study", config, "--against", str(tmp_path / "none.json")]) == 2
    assert main(["study", config, "--against", str(KEPT / "study.json"), "--runs", "3"]) == 2
    assert main(["study", config, "--against", str(KEPT / "study.json"), "--threads", "1"]) == 2  # it has other points


def test_a_figure_that_no_plugin_has_any_more_is_refused(tmp_path, capsys):
    """It was passed over: the gate held for figures that nobody looked at."""
    kept = json.loads((KEPT / "doppler.json").read_text())
    kept["figures"]["renamed"] = {"better": "less", "least": 0.1}
    (tmp_path / "kept.json").write_text(json.dumps(kept))
    assert main(["study", str(EXAMPLES / "doppler.toml"), "--against", str(tmp_path / "kept.json")]) == 2
    assert "renamed" in capsys.readouterr().err


def test_of_every_figure_it_is_known_whether_more_is_better():
    less = ["position_rmse", "velocity_rmse", "lost", "id_switches", "false_tracks", "gospa", "ospa", "confirmed_after"]
    less += ["trajectory_gospa", "ospa2", "motp", "siap_ambiguity", "siap_spuriousness", "siap_position", "siap_changes"]
    expected = [name for name, figure in study_figures().items() if figure.expected is not None]
    assert {*less, "approximated", *expected, *MORE, *UNJUDGED} == set(study_figures())
    assert not {*less, *expected} & {*MORE}


@pytest.mark.costly
def test_chance_alone_is_seldom_worse():
    rng, alarms = np.random.default_rng(4), 0
    for _ in range(1500):
        tests = [_compared("", "gospa", *rng.normal(5.0, 1.0, (2, 10)), LESS) for _ in range(8)]
        alarms += any(test.fails for test in _holm(tests))
    assert alarms <= 1500 * ALPHA + 4 * np.sqrt(1500 * ALPHA)


def test_what_is_worse_by_more_than_chance_fails_and_the_others_do_not():
    rng = np.random.default_rng(5)
    before = rng.normal(5.0, 1.0, (8, 10))
    tests = [_compared(str(i), "gospa", row, row + 0.01 * rng.normal(size=10), LESS) for i, row in enumerate(before)]
    worse = _compared("worse", "gospa", before[0], before[0] + 0.1 + 0.01 * rng.normal(size=10), LESS)
    assert [test.point for test in _holm([*tests, worse]) if test.fails] == ["worse"]
    more = _compared("more", "coverage", before[0], before[0] + 0.1, {"better": "more", "least": 1e-9})
    assert not any(test.fails for test in _holm([more]))
    fewer = _compared("fewer", "coverage", before[0], before[0] - 0.1, {"better": "more", "least": 1e-9})
    assert all(test.fails for test in _holm([fewer]))
    slight = evolve(worse, point="slight")
    assert _compared("slight", "gospa", before[0], before[0] * 1.001, {"better": "less", "least": 0.01}).fails is False
    gone = _compared("gone", "gospa", before[0], np.full(10, np.nan), LESS)
    assert [test.point for test in _holm([gone, slight]) if test.fails] == ["gone", "slight"]
    expected = {"better": "expected", "least": 1e-9}
    near = 1.0 + 0.01 * rng.normal(size=10)
    assert _compared("", "nis", near, near + 0.3, expected).fails
    assert not _holm([_compared("", "nis", near + 0.3, near, expected)])[0].fails
