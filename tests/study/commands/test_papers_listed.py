"""`vedette components` names each paper's contributions, and keeps apart what only shows a misprint."""

import json

import pytest

import vedette
from vedette.cli import main

PAPERS = ("vts", "target_oriented", "bayes_risk", "marine", "flir")
MISPRINTS = {
    *("bayes_risk_printed", "parallel_kalman_printed"),
    *("target_oriented_literal", "target_oriented_certain", "target_oriented_smoothed"),
}


@pytest.fixture(scope="module")
def registry():
    return vedette.Registry.installed()


@pytest.mark.parametrize("paper", PAPERS)
def test_contributions_are_components_that_are_installed(paper, registry):
    named = [part for parts in registry.get("reproduction", paper).contributions.values() for part in parts]
    assert len(named) >= 4
    for part in named:
        role, kind = part.split()
        assert registry.get(role, kind).kind == kind


def test_every_misprint_is_under_the_name_of_a_paper(registry):
    assert {entry.kind for entry in registry if entry.cls.misprint} == MISPRINTS
    named = {
        part.split()[1]
        for paper in PAPERS
        for parts in registry.get("reproduction", paper).contributions.values()
        for part in parts
    }
    assert named >= MISPRINTS


def test_the_listing_keeps_misprints_apart(capsys):
    assert main(["components"]) == 0
    chosen, apart = capsys.readouterr().out.split("not to be chosen: they only show what a paper prints")
    for kind in MISPRINTS:
        assert f"  {kind} " not in chosen
        assert f" {kind}" in apart


def test_what_a_role_lists_of_misprints_stands_apart(capsys):
    assert main(["components", "motion"]) == 0
    chosen, apart = capsys.readouterr().out.split("not to be chosen: they only show what a paper prints")
    assert "target_oriented_literal" not in chosen
    assert "target_oriented_literal  (" in apart


def test_a_study_names_what_each_contribution_is_made_of(capsys):
    assert main(["components", "vts"]) == 0
    told = "returns converted, with their covariance, equations 7 to 10: preprocessor naive_conversion, sensor"
    assert told in capsys.readouterr().out


def test_a_role_without_misprints_says_nothing_of_them(capsys):
    assert main(["components", "birth"]) == 0
    assert "not to be chosen" not in capsys.readouterr().out


def test_json_has_both(capsys):
    assert main(["components", "--json"]) == 0
    listed = {(one["role"], one["kind"]): one for one in json.loads(capsys.readouterr().out)["components"]}
    assert "spread of the means" in listed["estimator", "parallel_kalman_printed"]["misprint"]
    assert listed["reproduction", "vts"]["contributions"]["CVKF and CAKF, equations 14 to 19"] == ["estimator kalman"]
    assert "misprint" not in listed["estimator", "kalman"]
