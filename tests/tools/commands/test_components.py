"""`vedette components` and `vedette schema`, with third parties and what is broken."""

import json
import re

import vedette
from support.commands import in_json
from vedette.cli import main
from vedette.config.parameters import APART
from vedette_tools.json_schema import schema


def test_components_lists_third_parties_and_what_is_broken(acme, capsys):
    assert main(["components"]) == 0
    assert re.search(r"\n  acme_drift +Stands still but for white noise. \(acme 1.2\)\n", capsys.readouterr().out)
    assert main(["components", "motion"]) == 0
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
    options = ["--set", f"estimator={estimator}", "--set", "birth.spread={}"]
    code, figures = in_json(capsys, "run", config, *options, "--out", tmp_path / "results")
    assert code == 0
    assert figures["tracks"] > 0


def test_schema_prints_the_schema(capsys):
    assert main(["schema"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(schema()))


def test_the_overview_has_each_kind_once_in_a_line_and_the_tables_without_kinds(capsys):
    assert main(["components"]) == 0
    text = capsys.readouterr().out
    lines = text.splitlines()
    assert max(map(len, lines)) <= 120
    for entry in vedette.Registry.installed():
        if entry.role not in APART and not entry.cls.misprint:
            own = lines[lines.index(entry.role) + 1 :]
            named = [line.split()[0] for line in own[: own.index("")]]
            assert named.count(entry.kind) == 1
    tables = lines[lines.index("tables") + 1 :]
    assert [line.split()[0] for line in tables[: tables.index("")]] == ["gate", "identity", "registration", "judge"]
    assert "studies to reproduce: bayes_risk" in text


def test_a_kind_and_a_table_are_told_whole(capsys):
    assert main(["components", "m_of_n"]) == 0
    assert "      looks" in capsys.readouterr().out
    assert main(["components", "judge"]) == 0
    assert "  cover_radius " in capsys.readouterr().out


def test_what_is_no_kind_gets_a_question(capsys):
    assert main(["components", "EFK"]) == 2
    assert "EFK: is no role and no kind; did you mean 'ekf'?" in capsys.readouterr().err
    assert main(["components", "Gates"]) == 2
    assert "did you mean 'gate'?" in capsys.readouterr().err
