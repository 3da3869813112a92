"""Claims judged over a grid of what a paper leaves unsaid."""

from __future__ import annotations

import json
from typing import ClassVar

import pytest
from attrs import frozen

from vedette import Reproduction
from vedette.cli import main
from vedette.progress import silent
from vedette_report.findings import Cell, Condition, judged, remark
from vedette_study.checkpoint import Parts
from vedette_study.reproduction import data, text
from vedette_study.survey import survey
from vedette_vts.reproduction import VtsReproduction


@frozen
class Sums(Reproduction):
    """Claims on the sum of two numbers."""

    kind: ClassVar[str] = "sums"
    title: ClassVar[str] = "Sums"
    default_runs: ClassVar[int] = 10
    full_runs: ClassVar[int] = 10
    unsaid: ClassVar[dict[str, tuple[str, ...]]] = {"a": ("1", "2"), "b": ("0", "1", "2")}
    grid_runs: ClassVar[int] = 10

    def run(self, runs, seed, progress, keep=None):
        raise AssertionError("a grid needs no whole study")

    def claims_at(self, point, runs, seed):
        total = Cell(float(point["a"]) + float(point["b"]), 0.1)
        return judged("it is small", [Condition("sum", total, most=2.0)], runs), remark("it is nice", f"a is {point['a']}")


def test_each_claim_says_where_it_holds():
    found = survey(Sums(), 10, 1, silent)
    small, nice = found.claims
    assert small.verdict == "depends"
    assert small.headline == "HOLDS IN 1 OF 6, OPEN IN 2"
    assert [place.verdict[:5] for place in small.places] == ["repro", "not d", "not r", "not d", "not r", "not r"]
    assert nice.verdict == "remark"
    assert nice.why == "a is 1"
    lines = text(found).splitlines()
    start = next(i for i, line in enumerate(lines) if "it is small" in line)
    assert [line.split() for line in lines[start + 1 : start + 4]] == [
        ["a", "b", "0", "1", "2"],
        ["1", "holds", "open", "fails"],
        ["2", "open", "fails", "fails"],
    ]
    assert json.loads(json.dumps(data(found)))["claims"][0]["places"][0] == {
        "values": {"a": "1", "b": "0"}, "verdict": "reproduced"
    }  # fmt: skip


def test_points_are_kept_and_read_again(tmp_path):
    about = {"paper": "sums"}
    once = survey(Sums(), 10, 1, silent, Parts(tmp_path, about, resume=False))
    again = survey(Sums(), 10, 1, silent, Parts(tmp_path, about, resume=True))
    assert len(list((tmp_path / "parts").glob("*.npz"))) == 6
    assert again.claims == once.claims


@pytest.mark.costly
def test_the_command_prints_the_grid(monkeypatch, capsys):
    one = {name: dict([next(iter(values.items()))]) for name, values in VtsReproduction.unsaid.items()}
    monkeypatch.setattr(VtsReproduction, "unsaid", one)
    assert main(["reproduce", "vts", "--grid", "--runs", "3"]) == 0
    assert "HOLDS IN 0 OF 1" in capsys.readouterr().out


def test_a_study_without_a_grid_says_so(capsys):
    assert main(["reproduce", "marine-pictures", "--grid"]) == 2
    assert "--grid: " in capsys.readouterr().err
    with pytest.raises(NotImplementedError):
        Reproduction.claims_at(Sums(), {}, 1, 1)
