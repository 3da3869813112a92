"""A reproduction that is interrupted goes on where it was; its pictures come in three formats."""

import json

import numpy as np
import pytest
from attrs import frozen

from vedette import Reproduction
from vedette.cli import main
from vedette_report.findings import Cell, Chart, Condition, Curve, Findings, Panel, Table, afresh, judged, mean_cell, remark
from vedette_study.commands import reproduce
from vedette_study.panels import comparison, over_runs


@frozen(eq=False)
class Part:
    squares: np.ndarray
    modes: np.ndarray | None


@frozen
class Study(Reproduction):
    """Three parts of noise; `until` of them are made before Ctrl-C."""

    kind = "noise"
    title = "Noise"
    default_runs = 60
    full_runs = 70
    until: int = 3

    def run(self, runs, seed, progress, keep=afresh):
        made.clear()
        parts = [keep(f"part {i}", Part, lambda i=i: self.part(i, runs, seed)) for i in progress(range(3), "parts")]
        cells = tuple(mean_cell(np.mean(part.squares, axis=1)) for part in parts)
        claims = (judged("Noise is 1", [Condition("power", cells[0], 0.5, 1.5)], runs), remark("It is loud", "is it?"))
        rows = tuple((str(i), (cell, Cell(1.0, 0.1, 1.1))) for i, cell in enumerate(cells))
        table = Table("Power", ("ours", "other"), rows)
        root, doubt = over_runs(parts[0].squares)
        curve = Curve("error", np.arange(40.0), root, doubt=doubt)
        chart = Chart(
            "power", "Power", (Panel("p", "x [m]", "y [m]", (curve,)), comparison(table, ("ours", "other"), "W")), claims
        )
        return Findings("Noise", runs, seed, (table,), claims, (chart,))

    def part(self, i, runs, seed):
        if i >= self.until:
            raise KeyboardInterrupt
        made.append(i)
        return Part(np.random.default_rng([seed, i]).standard_normal((runs, 40)) ** 2, None if i else np.ones((2, 2)))


made = []


@pytest.fixture
def study(monkeypatch):
    def until(count):
        monkeypatch.setattr(reproduce, "_study", lambda name: Study(until=count))

    return until


@pytest.mark.costly
def test_an_interrupted_study_goes_on_to_the_same_result(study, tmp_path, capsys):
    study(3)
    assert main(["reproduce", "noise", "--runs", "4", "--out", str(tmp_path / "whole")]) == 0
    study(2)
    folder = tmp_path / "halved"
    assert main(["reproduce", "noise", "--runs", "4", "--out", str(folder)]) == 130
    assert sorted(path.name for path in (folder / "parts").iterdir()) == ["part-0.npz", "part-1.npz", "study.json"]
    study(3)
    assert main(["reproduce", "noise", "--runs", "4", "--out", str(folder)]) == 2
    assert "holds parts of an unfinished" in capsys.readouterr().err
    assert main(["reproduce", "noise", "--runs", "4", "--out", str(folder), "--resume"]) == 0
    assert made == [2]
    for name in ("study.txt", "study.json", "power.png"):
        assert (folder / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()
    assert {path.name for path in folder.iterdir()} == {"study.txt", "study.json", "power.png"}  # done: no parts


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (["--seed", "2"], "holds parts of another study: its seed 1"),
        (["--runs", "9"], "holds parts of another study: its runs 4"),
    ],
)
def test_parts_of_another_study_are_not_taken(other, message, study, tmp_path, capsys):
    study(1)
    wanted = ["reproduce", "noise", "--runs", "4", "--seed", "1", "--out", str(tmp_path)]
    assert main(wanted) == 130
    kept = (tmp_path / "parts" / "part-0.npz").read_bytes()
    study(3)
    assert main([*wanted, "--resume", *other]) == 2
    assert message in capsys.readouterr().err
    assert (tmp_path / "parts" / "part-0.npz").read_bytes() == kept


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04", b"no numbers", None])
def test_a_damaged_part_is_named(content, study, tmp_path, capsys):
    study(2)
    wanted = ["reproduce", "noise", "--runs", "4", "--out", str(tmp_path)]
    assert main(wanted) == 130
    part = tmp_path / "parts" / "part-1.npz"
    part.write_bytes((tmp_path / "parts" / "part-0.npz").read_bytes() if content is None else content)
    study(3)
    assert main([*wanted, "--resume"]) == 2
    told = capsys.readouterr().err
    assert str(part) in told
    assert "is not the part 'part 1' of this study" in told


def test_resume_needs_a_folder_and_what_the_parts_are_of(study, tmp_path, capsys):
    study(3)
    assert main(["reproduce", "noise", "--resume"]) == 2
    assert "--resume: needs the folder" in capsys.readouterr().err
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "study.json").write_text("[")
    assert main(["reproduce", "noise", "--out", str(tmp_path), "--resume"]) == 2
    assert "does not say which study's" in capsys.readouterr().err


def test_full_takes_the_runs_that_the_study_is_worth(study, capsys):
    study(3)
    assert main(["reproduce", "noise", "--full", "--json"]) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["runs"] == 70


@pytest.mark.parametrize(("form", "head"), [("png", b"\x89PNG"), ("svg", b"<?xml"), ("pdf", b"%PDF")])
@pytest.mark.costly
def test_pictures_come_as_asked_the_same_each_time(form, head, study, tmp_path):
    study(3)
    for name in "ab":
        assert main(["reproduce", "noise", "--out", str(tmp_path / name), "--format", form]) == 0
    first, second = (tmp_path / name / f"power.{form}" for name in "ab")
    assert first.read_bytes().startswith(head)
    assert first.read_bytes() == second.read_bytes()
    if form == "svg":
        for words in ("REPRODUCED", "Noise is 1", "published", "REMARK: It is loud", "y [m]"):
            assert words in first.read_text()
