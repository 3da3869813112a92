"""The page of a study: its tables and curves are the study's, and a run that is run anew is the run that it was.

VEDETTE_PICTURES names the folder where its picture is kept.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from support.browser import LACKING, Opened, browser
from support.paths import EXAMPLES
from vedette.cli import main
from vedette.config.files import read_file
from vedette_files import read_series
from vedette_study.grid import spaced_evenly_in_log, unit_at
from vedette_study.results import read_outcome
from vedette_study.worst_runs import worst

SWEPT = "estimator.motion.sigma_accel"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A study in lock-step, of few runs."""
    folder = tmp_path_factory.mktemp("study")
    table = read_file(EXAMPLES / "study.toml")
    table |= {"runs": 12, "sweep": {SWEPT: [0.1, 0.3, 1.0]}, "experiment": table["experiment"]}
    table["experiment"]["source"]["duration"] = 30
    (folder / "study.json").write_text(json.dumps(table))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vedette_report.output.can_draw", lambda: False)
        patch.setattr("vedette_study.commands.study.can_write", lambda *_: False)
        assert main(["study", str(folder / "study.json"), "--threads", "1", "--out", str(folder / "out")]) == 0
    return folder / "out"


def errors_of(series):
    """The square root of the mean squared error of the only track."""
    return np.sqrt(np.mean(np.sum((series["entries"]["mean"][:, :2] - series["truth"]["position"]) ** 2, axis=1)))


def test_the_result_is_read_back_from_the_folder_to_the_last_bit(folder):
    outcome, told = read_outcome(folder), json.loads((folder / "summary.json").read_text())
    assert outcome.data() == told
    assert [outcome.runs, outcome.plan.together] == [12, True]


@pytest.mark.costly
def test_a_run_that_is_run_anew_has_the_error_that_it_had_in_the_study(folder):
    outcome = read_outcome(folder)
    bad = worst(outcome, 2)
    assert [len(runs) for runs in bad] == [2, 2, 2]
    values = np.sqrt(outcome.figures["position_rmse"])
    assert [runs[0].run for runs in bad] == np.argmax(values, axis=1).tolist()
    assert main(["report", str(folder), "--worst", "1", "--run", "1-3"]) == 0
    for point, run in [(each[0].point, each[0].run) for each in bad] + [(1, 3)]:
        own = folder / "worst" / f"{point}-{run}"
        assert errors_of(read_series(own / "series.npz")) == pytest.approx(values[point, run], rel=1e-9)
        assert (own / "report.html").exists()
        assert f"Run {run} of point {point}" in (own / "summary.txt").read_text()


def test_runs_that_go_one_by_one_are_run_anew_as_they_were(tmp_path, monkeypatch):
    monkeypatch.setattr("vedette_report.output.can_draw", lambda: False)
    monkeypatch.setattr("vedette_study.commands.study.can_write", lambda *_: False)
    table = read_file(EXAMPLES / "study.toml")
    experiment = table["experiment"]
    experiment["lifecycle"] = {"kind": "m_of_n"}
    experiment["birth"] = {"kind": "from_returns", "spread": {"vx": 5.0, "vy": 5.0}}
    experiment["source"]["duration"] = 10
    plan = {"experiment": experiment, "runs": 2, "seed": 4, "sweep": {SWEPT: [0.3, 1.0]}}
    (tmp_path / "study.json").write_text(json.dumps(plan))
    assert main(["study", str(tmp_path / "study.json"), "--threads", "1", "--out", str(tmp_path / "out")]) == 0
    outcome = read_outcome(tmp_path / "out")
    assert not outcome.plan.together
    (first, *_), _ = worst(outcome, 1)
    assert main(["report", str(tmp_path / "out"), "--worst", "1"]) == 0
    figures = json.loads((tmp_path / "out" / "worst" / first.name / "summary.json").read_text())
    assert figures["gospa_m"] == pytest.approx(first.value, rel=1e-12)
    assert first.value == np.max(outcome.figures["gospa"][0])


@pytest.mark.parametrize(
    ("arguments", "piece"),
    [
        (["--run", "7-0"], "--run: must be POINT-RUN with a point from 0 to 2 and a run from 0 to 11, got '7-0'"),
        (["--run", "now"], "got 'now'"),
        (["--worst", "many"], "--worst: must be a whole number of at least 0, got 'many'"),
    ],
)
def test_wrong_runs_are_refused(folder, capsys, arguments, piece):
    assert main(["report", str(folder), *arguments]) == 2
    assert piece in capsys.readouterr().err


def test_a_study_that_is_not_whole_says_what_to_do(folder, tmp_path, capsys):
    (tmp_path / "manifest.json").write_bytes((folder / "manifest.json").read_bytes())
    assert main(["report", str(tmp_path)]) == 2
    assert "summary.json: there is no such file; `vedette study --resume` finishes the study" in capsys.readouterr().err
    (tmp_path / "summary.json").write_bytes((folder / "summary.json").read_bytes())
    assert main(["report", str(tmp_path)]) == 2
    assert "chunk 0 is missing or not" in capsys.readouterr().err
    made = json.loads((folder / "manifest.json").read_text())
    (tmp_path / "manifest.json").write_text(json.dumps(made | {"study": "0"}))
    assert main(["report", str(tmp_path)]) == 2
    assert "reads its study otherwise" in capsys.readouterr().err


def test_options_of_a_study_are_refused_for_runs(tmp_path, capsys):
    assert main(["report", str(tmp_path), "--worst", "2"]) == 2
    assert "is no study's folder" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("values", "log"),
    [
        ([0.1, 0.2, 0.3, 0.5, 1.0], True),
        ([1, 2, 3, 4], False),
        ([1, 2, 4, 8], True),
        ([0.0, 0.1, 1.0], False),
        ([1.0, 2.0], False),
        ([1.0, 10.0], True),
        ([5.0], False),
        ([0.9, 0.95, 0.99, 1.0], False),
    ],
)
def test_a_sweep_is_drawn_on_the_axis_that_it_was_made_for(values, log):
    assert spaced_evenly_in_log(values) is log


def test_swept_parameters_have_their_units(folder):
    experiment = read_outcome(folder).plan.points[0].experiment
    assert unit_at(experiment, SWEPT) == "m/s^1.5"
    assert unit_at(experiment, "sensors.radar.sigma") == "m"
    assert unit_at(experiment, "sensors.radar.detection_probability") == ""
    assert unit_at(experiment, "judge.cover_radius") == "m"
    assert unit_at(experiment, "sensors.sonar.sigma") == ""


@pytest.mark.skipif(LACKING is not None, reason=str(LACKING))
@pytest.mark.costly
def test_its_tables_and_curves_are_the_study_s_and_the_worst_runs_one_click_away(folder):
    assert main(["report", str(folder), "--worst", "1", "--out", str(folder / "page.html")]) == 0
    outcome = read_outcome(folder)
    with browser() as running:
        phone = Opened(running, folder / "page.html", 390, 844)
        assert phone.tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
        opened = Opened(running, folder / "page.html")
        tab = opened.tab
        assert opened.said == []
        assert opened.asked[1:] == []
        rows = tab.locator("#tables table").first.locator("tbody tr")
        for i, text in enumerate(rows.all_inner_texts()):
            mean = outcome.means(i)["position_rmse"]
            value, error = map(float, text.split("\t")[1].split(" ± "))
            assert (value, error) == (pytest.approx(mean.value, abs=0.06 * mean.error), pytest.approx(mean.error, rel=0.06))
        sweep = "facts.charts.find(({ name }) => name === 'sweep_sigma_accel').panels[0]"
        assert tab.evaluate(f"{sweep}.logAcross")
        assert tab.evaluate(f"{sweep}.across") == f"{SWEPT} [m/s^1.5]"
        assert tab.locator("polygon.band").count() == 3 * 3 + 4
        assert tab.evaluate("[[2, 3], [1, 2, 4], [0.1, 0.3]].map((values) => axisOf(values, false).ticks)") == [
            [2, 3],
            [1, 2, 3, 4],
            [0.1, 0.15, 0.2, 0.25, 0.3],
        ]
        heads = "[...document.querySelectorAll('#tables th')].filter((head) => head.clientHeight > 30).length"
        assert tab.evaluate(heads) == 0, "a heading is broken within its word"
        curve = tab.evaluate(f"{sweep}.curves[0]")
        for i, found in enumerate(outcome.means(i)["position_rmse"] for i in range(3)):
            assert [curve["y"][i], curve["doubt"][i]] == pytest.approx([found.value, 2 * found.error], rel=1e-5)
        bad = worst(outcome, 1)[2][0]
        first = tab.locator("#worst .runs").nth(2).locator("tr").first.inner_text()
        assert first.startswith(f"run {bad.run}\t{float(f'{bad.value:.4g}'):g}")
        commands = tab.evaluate("[...document.querySelectorAll('.command')].map(({ value }) => value)")
        assert commands[0] == f"vedette report {folder} --worst 5"
        assert all(command.startswith(f"vedette report {folder} --") for command in commands)
        path = Path(os.environ.get("VEDETTE_PICTURES", folder)) / "study_page.png"
        tab.screenshot(path=path)
        assert path.stat().st_size > 20_000
        tab.locator("a", has_text="its page").first.click()
        opened.wait("Boolean(document.documentElement.dataset.ready) && Boolean(window.page)")
        assert "/worst/" in tab.url
        assert opened.said == []
