"""Several runs on one page: their figures side by side, the series of smoothed tracks, what does not go together."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from support.browser import LACKING, Opened, browser
from support.results import config
from vedette.cli import main
from vedette_files import read_series, read_tracks
from vedette_files.series import SeriesFile
from vedette_report.page.metrics import meanings, metrics


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """A run with its smoothed tracks, and one of the same scans by another tracker."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "config.json").write_text(json.dumps(config()))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("vedette_report.drawing.brought.can_draw", lambda: False)
        for name, more in (("one", ["--smooth"]), ("other", ["--set", "estimator.modes[1].motion.sigma_accel=3.0"])):
            assert main(["run", str(folder / "config.json"), "--out", str(folder / name), *more]) == 0
    return folder / "one", folder / "other"


@pytest.mark.costly
def test_the_series_of_smoothed_tracks_are_those_tracks_and_their_errors(folders):
    filtered, smoothed = (read_series(folders[0] / name) for name in ("series.npz", "smoothed.npz"))
    entries, times = smoothed["entries"], smoothed["scans"]["time"]
    compared = 0
    for track in read_tracks(folders[0] / "smoothed.jsonl"):
        rows = np.flatnonzero(entries["track"] == track.id)
        np.testing.assert_array_equal(times[entries["scan"][rows]], track.times)
        np.testing.assert_array_equal(entries["mean"][rows], track.mean)
        upper = np.triu_indices(len(track.space))
        np.testing.assert_array_equal(entries["cov"][rows], track.cov[:, upper[0], upper[1]])
        compared += len(rows)
    assert compared > 30
    truth = {
        (scan, which): place
        for scan, which, place in zip(*(smoothed["truth"][name] for name in ("scan", "object", "position")), strict=True)
    }
    covered = np.flatnonzero(entries["object"] >= 0)
    errors = [entries["mean"][i, :2] - truth[entries["scan"][i], entries["object"][i]] for i in covered]
    np.testing.assert_allclose(entries["position_error"][covered], np.linalg.norm(errors, axis=1), atol=1e-9)
    assert np.mean(entries["position_error"][covered] ** 2) < 0.8 * np.nanmean(filtered["entries"]["position_error"] ** 2)
    for name in ("nis", "hit", "existence", "gate_cov"):
        np.testing.assert_array_equal(entries[name], filtered["entries"][name])
    for table in ("returns", "weights", "truth"):
        for name, values in filtered[table].items():
            np.testing.assert_array_equal(smoothed[table][name], values)
    told = json.loads((folders[0] / "summary.json").read_text())["smoothed"]["position_rmse_m"]
    count = smoothed["scans"]["covered"]
    rmse = np.sqrt(np.nansum(count * np.nan_to_num(smoothed["scans"]["position_rmse"]) ** 2) / count.sum())
    assert rmse == pytest.approx(told, rel=1e-6)


def test_figures_stand_side_by_side_with_their_units():
    first = {"seed": 1, "position_rmse_m": 3.0, "bias_m": [1.0, 2.0], "coverage": 0.5, "notes": {}, "nis": None, "own": 4.0}
    second = {"position_rmse_m": 5.0, "bias_m": [0.0, 1.0], "coverage": None, "truths": [{"name": "a", "coverage": 1.0}]}
    alone = metrics([first], (), ("x", "y"), "px")
    told = {row["name"]: (row["about"], row["unit"], row["values"]) for row in alone["rows"]}
    assert told["position_rmse_m"] == ("position error, RMS while covered", "px", [3.0])
    assert told["bias_m.1"] == ("mean error, y", "px", [2.0])
    assert told["own"] == ("own", "", [4.0])
    assert not {"seed", "nis", "notes"} & set(told)
    both = metrics([first, second], (), ("x", "y"), "m")
    assert {row["name"]: row["values"] for row in both["rows"]} == {
        "position_rmse_m": [3.0, 5.0],
        "bias_m.0": [1.0, 0.0],
        "bias_m.1": [2.0, 1.0],
    }
    assert both["objects"] == []
    assert metrics([second], (), (), "m")["objects"][0]["coverage"] == [1.0]


def test_every_figure_of_a_summary_has_words(folders):
    figures = json.loads((folders[1] / "summary.json").read_text())
    names = {row["name"].split(".")[0] for row in metrics([figures], ("a", "b"), ("x", "y"), "m")["rows"]}
    assert names <= set(meanings())
    assert {"position_rmse_m", "gospa_m", "nis", "mode_prob"} <= names


def test_the_page_of_two_runs_is_where_it_is_said_to_be(folders, tmp_path, capsys):
    one, other = folders
    assert main(["report", str(one), str(other), "--out", str(tmp_path / "both.html")]) == 0
    assert (tmp_path / "both.html").stat().st_size > 50_000
    assert main(["report", str(one), str(one / "smoothed.npz")]) == 0
    assert str(one / "compare.html") in capsys.readouterr().out
    assert main(["report", str(one / "smoothed.npz")]) == 0
    assert (one / "smoothed.html").exists()
    assert not (one / "report.html").exists()


def test_runs_over_other_axes_or_too_many_are_refused_by_name(folders, tmp_path, capsys):
    one, other = folders
    series = read_series(other / "series.npz")
    for name in ("config.json", "summary.txt"):
        (tmp_path / name).write_bytes((other / name).read_bytes())
    file = SeriesFile(tmp_path / "series.npz", series.about | {"unit": "px"})
    file.add(series.tables)
    file.flush()
    assert main(["report", str(one), str(tmp_path)]) == 2
    assert f"{tmp_path}: the axes of its map must be those of {one}, x, y in m, got x, y in px" in capsys.readouterr().err
    assert main(["report", *[str(one)] * 5]) == 2
    assert "at most 4 runs, got 5" in capsys.readouterr().err


def on_the_page(told, value):
    """Whether a number as it is shown, with four digits, is the file's, of which the page keeps 17 bits."""
    return told == "\N{EN DASH}" if not np.isfinite(value) else float(told) == pytest.approx(value, rel=6e-4)


@pytest.fixture(scope="module", params=[(1400, 900), (390, 844)], ids=["desktop", "phone"])
def opened(request, folders, tmp_path_factory):
    if LACKING is not None:
        pytest.skip(LACKING)
    page = tmp_path_factory.mktemp("page") / "both.html"
    one, other = folders
    assert main(["report", str(one), str(one / "smoothed.npz"), str(other), "--out", str(page)]) == 0
    with browser() as running:
        yield Opened(running, page, *request.param)


@pytest.mark.by_turns
def test_one_cursor_moves_all_runs_and_every_value_is_its_file_s(folders, opened):
    one, other = folders
    files = [read_series(path) for path in (one / "series.npz", one / "smoothed.npz", other / "series.npz")]
    opened.tab.evaluate("page.choose({})")
    for scan in (0, 11, 29):
        opened.tab.evaluate("scan => page.goTo(scan)", scan)
        told = opened.values()
        for i, series in enumerate(files):
            for name in ("position_rmse", "nees", "nis", "covered"):
                assert on_the_page(told[f"{i}.{name}"], series["scans"][name][scan]), (scan, i, name)
        heads = opened.tab.locator(".chart h2").all_inner_texts()
        assert [head.split(",")[0] for head in heads] == [
            "Position error",
            "NEES of the position",
            "NIS",
            "Objects that a track covers",
        ]
    assert opened.said == []
    assert opened.asked[1:] == []
    assert opened.tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")


@pytest.mark.by_turns
def test_a_picture_of_it_is_taken_for_the_docs(opened, tmp_path):
    """VEDETTE_PICTURES names the folder where it is kept."""
    name = "compare.png" if opened.tab.viewport_size["width"] == 1400 else "compare_phone.png"
    opened.tab.evaluate("page.choose({}); page.goTo(28)")
    path = Path(os.environ.get("VEDETTE_PICTURES", tmp_path)) / name
    opened.tab.screenshot(path=path)
    assert path.stat().st_size > 20_000


@pytest.mark.by_turns
def test_each_run_can_be_turned_off_on_the_map_and_in_the_charts(opened):
    tab = opened.tab
    tab.evaluate("page.choose({}); page.goTo(20)")
    picture, lines = "document.getElementById('map').toDataURL()", "page.charts.plots[0].spec.lines.map(({ name }) => name)"
    before = tab.evaluate(picture)
    assert tab.evaluate(lines) == ["one", "one (smoothed)", "other"]
    for i, name in enumerate(["one", "one (smoothed)", "other"]):
        tab.locator("#runs label").nth(i).click()
        assert name not in tab.evaluate(lines)
        assert tab.evaluate(picture) != before
        tab.locator("#runs label").nth(i).click()
        assert tab.evaluate(picture) == before


@pytest.mark.by_turns
def test_a_click_on_a_track_shows_it_in_its_own_run(folders, opened):
    entries = read_series(folders[1] / "series.npz")["entries"]
    row = np.flatnonzero((entries["scan"] == 25) & entries["confirmed"])[0]
    opened.tab.evaluate("page.goTo(25); page.switches.slice(0, 2).forEach((box) => box.click())")
    x, y = entries["mean"][row, :2].tolist()
    centre = "page.data.facts.centre"
    at = opened.tab.evaluate(f"([x, y]) => [page.map.px(x - {centre}[0]), page.map.py(y - {centre}[1])]", [x, y])
    opened.tab.locator("#map").click(position={"x": at[0], "y": at[1]})
    assert opened.tab.locator("#chosen").inner_text().startswith(f"Track {entries['track'][row]}")
    assert opened.tab.locator("#details p").first.inner_text() == "other"
    assert on_the_page(opened.values()["position_error"], entries["position_error"][row])
    opened.tab.evaluate("page.choose({}); page.switches.slice(0, 2).forEach((box) => box.click())")


@pytest.mark.by_turns
def test_figures_of_the_summaries_stand_beside_each_other_with_differences(folders, opened):
    one, other = (json.loads((folder / "summary.json").read_text()) for folder in folders)
    cells = opened.tab.locator('[data-figure="position_rmse_m"] td').all_inner_texts()
    first, smoothed, last = one["position_rmse_m"], one["smoothed"]["position_rmse_m"], other["position_rmse_m"]
    for text, value in zip(cells, (first, smoothed, smoothed - first, last, last - first), strict=True):
        assert on_the_page(text.replace("\N{MINUS SIGN}", "-"), value)


@pytest.mark.by_turns
def test_the_life_of_the_tracks_of_all_runs_is_shown_and_a_click_chooses_one(folders, opened):
    tab = opened.tab
    tab.evaluate("page.choose({}); page.goTo(25)")
    folder, other = folders
    lived = []
    for run, path in enumerate((folder / "series.npz", folder / "smoothed.npz", other / "series.npz")):
        entries = read_series(path)["entries"]
        lived += [[run, track] for track in np.unique(entries["track"][entries["confirmed"]]).tolist()]
    told = "page.timeline.rows.map(({ run, track }) => [run, page.data.runs[run].tracks.id[track]])"
    assert tab.evaluate(told) == lived
    number = next(i for i, (run, _) in enumerate(lived) if run == 2)
    spot = tab.evaluate(f"[page.timeline.at(page.data.scans.time[25]), ({number} + 0.5) * page.timeline.step]")
    tab.locator("#timeline").click(position={"x": spot[0], "y": spot[1]})
    assert tab.locator("#chosen").inner_text().startswith(f"Track {lived[number][1]}")
    assert tab.locator("#details p").first.inner_text() == "other"
    tab.evaluate("page.choose({})")
    colour = "([x, y]) => [...page.timeline.canvas.getContext('2d').getImageData(x, y, 1, 1).data].slice(0, 3)"
    assert tab.evaluate(colour, spot) == [0x00, 0x9E, 0x73], "the colour of the third run"
    tab.locator("#runs label").nth(2).click()
    assert tab.evaluate(told) == [each for each in lived if each[0] < 2]
    tab.locator("#runs label").nth(2).click()
