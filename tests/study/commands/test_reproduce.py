"""The command that runs a published study anew, and the figures that studies are made of."""

from __future__ import annotations

import json

import numpy as np
import pytest

from vedette import Gaussian, Registry, Space
from vedette.cli import main
from vedette_report.drawing.chart import draw
from vedette_report.findings import Cell, Chart, Claim, Curve, Findings, Panel, Table, mean_cell, ratio_cell, rms_cell
from vedette_study.reproduction import data, text
from vedette_study.starts import over_axes, two_point

PAPERS = ("vts", "target-oriented", "bayes-risk", "marine")


BY_NIGHT = pytest.mark.nightly("studies, of 2 to 8 s; by day one shows that the command runs, prints and draws")


@pytest.mark.parametrize("paper", [pytest.param(paper, marks=() if paper == "vts" else BY_NIGHT) for paper in PAPERS])
@pytest.mark.costly
def test_a_study_prints_its_tables_and_verdicts_and_ends_well(paper, capsys, tmp_path):
    folder = tmp_path / "made" / "here"
    assert main(["reproduce", paper, "--runs", "3", "--json", "--out", str(folder)]) == 0
    lines = capsys.readouterr().out.splitlines()
    found = json.loads(lines[-1])
    assert found["runs"] == 3
    assert found["seed"] == 1
    assert found["cpu_seconds"] > 0
    assert {claim["verdict"] for claim in found["claims"]} <= {
        "reproduced",
        "not reproduced",
        "not decided",
        "remark",
        "depends",
    }
    assert all(claim["why"] or claim["conditions"] for claim in found["claims"])
    for claim in found["claims"]:
        told = [line for line in lines if line.startswith(f"* {claim['verdict'].upper()}")]
        assert any(claim["text"][:25] in line for line in told)
    figures = [cell for table in found["tables"] for row in table["rows"].values() for cell in row.values()]
    assert all(set(cell) == {"measured", "error", "published", "trimmed"} for cell in figures)
    assert json.loads((folder / "study.json").read_text()) == {k: v for k, v in found.items() if k != "cpu_seconds"}
    pictures = sorted(folder.glob("*.png"))
    assert {"errors.png", "trajectory.png", "modes.png"} <= {path.name for path in pictures}
    assert all(path.read_bytes()[:4] == b"\x89PNG" and path.stat().st_size > 10_000 for path in pictures)
    assert {path.suffix for path in folder.iterdir()} == {".png", ".txt", ".json"}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no-such-paper"], "reproduction: unknown kind 'no_such_paper'; installed: bayes_risk"),
        (["bayes-rsk"], "did you mean 'bayes_risk'?"),
        (["vts", "--runs", "1"], "--runs: must be a whole number of at least 2, got '1'"),
        (["vts", "--runs", "many"], "--runs: must be a whole number of at least 2, got 'many'"),
        (["vts", "--runs", "2.5"], "--runs: must be a whole number of at least 2, got '2.5'"),
        (["vts", "--seed", "-1"], "--seed: must be a whole number of at least 0, got '-1'"),
        (["vts", "--out", __file__], "is a file, and results need"),
    ],
)
def test_wrong_use_is_told(arguments, message, capsys):
    assert main(["reproduce", *arguments]) == 2
    told = capsys.readouterr()
    assert message in told.err
    assert not told.out


def test_the_help_names_every_installed_study(capsys):
    with pytest.raises(SystemExit):
        main(["reproduce", "--help"])
    told = capsys.readouterr().out
    kinds = [entry.kind.replace("_", "-") for entry in Registry.installed() if entry.role == "reproduction"]
    assert len(kinds) >= 6
    assert not [kind for kind in kinds if kind not in "".join(told.split()) and kind not in told]


@pytest.mark.parametrize("paper", PAPERS)
def test_studies_are_components(paper):
    entry = Registry.installed().get("reproduction", paper.replace("-", "_"))
    assert entry.cls.default_runs >= (28 if paper == "marine" else 500)  # a marine run is up to 1,000 scans
    assert entry.parameters == ()


# What their figures are made of.


def test_a_mean_and_its_error():
    values = np.array([1.0, 2, 3, 6])
    assert mean_cell(values, 5.0, scale=10) == Cell(30.0, 10 * values.std(ddof=1) / 2, 5.0)
    assert mean_cell(values[:1]) == Cell(1.0, None)
    assert mean_cell(values[:0], 2.0) == Cell(None, None, 2.0)


def test_errors_of_rms_and_ratio_are_the_spread_over_repetitions():
    """200 studies of 400 runs: the stated error within a quarter of the true one, whose own error is 5 %."""
    rng = np.random.default_rng(1)
    scale = rng.gamma(4.0, 0.25, (200, 400, 1))  # runs of unlike size, which both filters share
    under = scale * rng.standard_normal((200, 400, 10)) ** 2
    over = 0.5 * under + scale * rng.standard_normal((200, 400, 10)) ** 2
    rms = [rms_cell(part) for part in over]
    ratios = [ratio_cell(*pair) for pair in zip(over, under, strict=True)]
    for cells in (rms, ratios):
        spread = np.std([cell.measured for cell in cells])
        stated = np.mean([cell.error for cell in cells])
        assert 0.75 < stated / spread < 1.25
    assert np.isclose(np.mean([cell.measured for cell in ratios]), np.sqrt(1.5), rtol=0.02)


def test_without_runs_there_is_no_figure():
    none = np.zeros((0, 5))
    assert rms_cell(none, 3.0) == Cell(None, None, 3.0)
    assert ratio_cell(none, none) == Cell(None, None, None)
    assert ratio_cell(np.ones((3, 2)), np.zeros((3, 2))) == Cell(None, None, None)


def test_two_points_against_least_squares():
    rng = np.random.default_rng(2)
    z1, z2 = rng.standard_normal((2, 3, 2))
    R1, R2 = (root @ np.swapaxes(root, -1, -2) for root in rng.standard_normal((2, 3, 2, 2)))
    made = two_point(Gaussian(z1, R1), Gaussian(z2, R2), 4.0)
    assert made.mean.shape == (3, 1, 4)
    eye, none = np.eye(2), np.zeros((2, 2))
    H = np.block([[eye, -4.0 * eye], [eye, none]])  # both returns of x, v at the second
    for i in range(3):
        R = np.block([[R1[i], none], [none, R2[i]]])
        information = H.T @ np.linalg.solve(R, H)
        np.testing.assert_allclose(np.linalg.inv(information), made.cov[i, 0], rtol=1e-8, atol=1e-10)
        mean = np.linalg.solve(information, H.T @ np.linalg.solve(R, np.concatenate([z1[i], z2[i]])))
        np.testing.assert_allclose(mean, made.mean[i, 0], rtol=1e-8, atol=1e-10)


def test_a_prior_over_more_axes_in_another_order():
    space, state = Space.of(x="m", y="m"), Space.of(y="m", rate="1/s", x="m")
    made = over_axes(Gaussian(np.array([[1.0, 2]]), np.array([[[4.0, 1], [1, 9]]])), space, state, {"rate": (7.0, 3.0)})
    np.testing.assert_array_equal(made.mean, [[2, 7, 1]])
    np.testing.assert_array_equal(made.cov, [[[9, 0, 1], [0, 9, 0], [1, 0, 4]]])


RESULT = Findings(
    "A paper",
    1500,
    3,
    (
        Table(
            "Errors",
            ("one", "two"),
            (("ours", (Cell(1.23456, 0.0312), Cell(None, None, 7.5))), ("theirs", (Cell(12.0), Cell(3.0, 0.0)))),
            "m",
        ),
    ),
    (Claim("It is better", "not reproduced", "it is not"),),
    (Chart("name", "Title", (Panel("p", "x", "y", (Curve("c", np.arange(3.0), np.arange(3.0), "dots"),), equal=True),)),),
)


def test_figures_are_printed_with_as_many_digits_as_they_have():
    lines = text(RESULT).splitlines()
    assert lines[1] == "1,500 runs, seed 3; +- is one Monte-Carlo standard error"
    assert lines[4:9] == [
        "m",
        "                        one  two",
        "ours         1.235 +- 0.031    -",
        "  published                  7.5",
        "theirs                   12    3",
    ]
    assert lines[-2:] == ["* NOT REPRODUCED: It is better", "  it is not"]
    assert RESULT.tables[0].cell("ours", "two").published == 7.5


def test_plain_data_survives_json():
    assert json.loads(json.dumps(data(RESULT)))["tables"][0]["rows"]["ours"]["one"]["measured"] == 1.23456


def test_a_chart_shows_its_panels():
    made = draw(RESULT.charts[0])
    (axes,) = made.axes
    assert axes.get_title(loc="left") == "p"
    assert axes.get_aspect() == 1
    assert axes.get_lines()[0].get_marker() == "."
