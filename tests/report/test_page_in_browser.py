"""The page of a run in a real Chromium: what it shows is what the file holds, and its inputs do what they say."""

import json
import os
import re
from pathlib import Path

import numpy as np
import pytest

from support.browser import LACKING, Opened, browser
from support.paths import EXAMPLES
from vedette.cli import main
from vedette_files import read_series

pytestmark = [pytest.mark.by_turns, pytest.mark.skipif(LACKING is not None, reason=str(LACKING))]
NONE = "\N{EN DASH}"
WIDE, PHONE = (1400, 900), (390, 844)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("harbour")
    assert main(["run", str(EXAMPLES / "harbour.toml"), "--out", str(folder), "--stream", "--report"]) == 0
    return folder


@pytest.fixture(scope="module")
def running():
    with browser() as running:
        yield running


@pytest.fixture(scope="module", params=[WIDE, PHONE], ids=["desktop", "phone"])
def opened(request, folder, running):
    return Opened(running, folder / "report.html", *request.param)


def agrees(text, value):
    """Whether a number as it is shown is the file's, to the digits shown; the page keeps 17 bits of it."""
    if not np.isfinite(value):
        return text == NONE
    digits = re.fullmatch(r"-?\d+(?:\.(\d+))?(?:e([+-]\d+))?", text)
    unit = 10.0 ** (int(digits[2] or 0) - len(digits[1] or ""))
    if digits[1] is None and digits[2] is None and abs(value) >= 1e4:
        unit = 10.0 ** (np.floor(np.log10(abs(value))) - 3)
    return abs(float(text) - value) <= 0.5 * unit + 2**-17 * abs(value) * 1.01


def test_it_is_small_and_silent_and_asks_for_nothing(folder, opened):
    page = folder / "report.html"
    assert page.stat().st_size <= 1.5e6
    assert opened.said == []
    assert opened.asked == [page.as_uri()]
    assert opened.tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth"), "no scrolling sideways"


def test_pictures_of_it_are_taken_for_the_docs(opened, tmp_path):
    """VEDETTE_PICTURES names the folder where they are kept."""
    name = "page.png" if opened.tab.viewport_size["width"] == WIDE[0] else "page_phone.png"
    opened.tab.evaluate("page.goTo(72); page.choose({ track: page.data.tracks.confirmed.indexOf(1) })")
    path = Path(os.environ.get("VEDETTE_PICTURES", tmp_path)) / name
    opened.tab.screenshot(path=path)
    assert path.stat().st_size > 20_000


def test_the_slider_moves_the_scan(opened):
    tab = opened.tab
    tab.evaluate("page.choose({})")
    tab.locator("#slider").focus()
    for key, scan in (("End", 120), ("Home", 0), ("ArrowRight", 1)):
        tab.keyboard.press(key)
        assert tab.evaluate("page.state.scan") == scan
        assert tab.locator("#details h2").inner_text() == f"Scan {scan + 1} of 121"
        assert tab.locator("#clock").inner_text() == f"{2.5 * scan:.2f} s"


def test_playback_runs_at_the_speed_that_is_asked_for_and_stops_at_the_end(opened):
    tab = opened.tab
    tab.evaluate("page.goTo(0)")
    tab.locator("#speed").select_option("20")
    tab.locator("#play").click()
    opened.wait("page.state.scan >= 4")
    tab.locator("#play").click()
    stopped = tab.evaluate("page.state.scan")
    assert not tab.evaluate("page.state.playing")
    tab.locator("#speed").select_option("100")
    tab.evaluate("page.goTo(115)")
    tab.locator("#play").click()
    opened.wait("page.state.scan === 120 && !page.state.playing")
    assert 4 <= stopped < 115
    assert opened.said == []


def test_a_click_on_a_track_shows_that_track_and_a_click_beside_lets_it_go(folder, opened):
    series, tab = read_series(folder / "series.npz"), opened.tab
    tab.evaluate("page.choose({}); page.goTo(60)")
    entries = series["entries"]
    for row in np.flatnonzero((entries["scan"] == 60) & entries["confirmed"]).tolist():
        x, y = entries["mean"][row, :2].tolist()
        at = tab.evaluate(
            "([x, y]) => [page.map.px(x - page.data.facts.centre[0]), page.map.py(y - page.data.facts.centre[1])]", [x, y]
        )
        tab.locator("#map").click(position={"x": at[0], "y": at[1]})
        assert tab.locator("#chosen").inner_text().startswith(f"Track {entries['track'][row]}")
        assert tab.locator(".chart h2").first.inner_text().startswith(f"Track {entries['track'][row]}:")
    tab.locator("#map").click(position={"x": 3, "y": 3})
    assert tab.locator("#chosen").count() == 0


def test_each_chart_is_as_wide_as_its_place_and_its_line_is_at_the_scan(opened):
    tab = opened.tab
    for choice in ("{}", "{ track: page.data.tracks.confirmed.indexOf(1) }"):
        tab.evaluate(f"page.choose({choice}); page.goTo(60)")
        widths = tab.evaluate("page.charts.plots.map(({ chart, frame }) => [chart.width, frame.clientWidth])")
        assert len(widths) >= 4
        assert all(chart == frame for chart, frame in widths)
        left = "(element) => element.getBoundingClientRect().x"
        lines = (
            f"page.charts.plots.map(({{ chart, now }}) => [chart.over.clientWidth, ({left})(now) - ({left})(chart.over)])"
        )
        for width, at in tab.evaluate(lines):
            assert at == pytest.approx(width / 2, abs=2), "150 s of 300 s"


def test_every_value_of_a_track_is_the_file_s(folder, opened):
    series, tab = read_series(folder / "series.npz"), opened.tab
    entries = series["entries"]
    rows = np.flatnonzero(entries["confirmed"])[::41]
    assert len(rows) > 10
    for row in rows.tolist():
        tab.evaluate(
            "([scan, id]) => { page.goTo(scan); page.choose({ track: page.data.tracks.id.indexOf(id) }); }",
            [int(entries["scan"][row]), int(entries["track"][row])],
        )
        told = opened.values()
        told["x"], told["x_sd"] = told["x"].split(" ± ")
        told["y"], told["y_sd"] = told["y"].split(" ± ")
        mean, cov = entries["mean"][row], entries["cov"][row]
        wanted = {
            name: entries[name][row] for name in ("position_error", "position_sigma", "nees", "nis_given_hit", "existence")
        }
        wanted |= {"x": mean[0], "y": mean[1], "x_sd": np.sqrt(cov[0]), "y_sd": np.sqrt(cov[5])}
        wanted |= {"speed": np.hypot(mean[2], mean[3])} | {f"mode{i}": entries["modes"][row, i] for i in range(2)}
        assert {name for name, value in wanted.items() if not agrees(told[name], value)} == set(), (told, wanted)
        assert set(told) == {*wanted, "object"}
        assert told["object"] == (series.about["objects"][entries["object"][row]] if entries["object"][row] >= 0 else NONE)
        own = series["weights"]["entry"] == row
        largest = np.sort(series["weights"]["weight"][own])[::-1]
        shown = tab.locator("#weights tbody td:last-child").all_inner_texts()
        assert len(shown) == 1 + min(4, np.count_nonzero(largest > 0.01))
        assert all(agrees(text, value) for text, value in zip(shown[:-1], largest, strict=False))
        assert agrees(shown[-1], 1 - entries["hit"][row])


def test_every_value_of_a_scan_is_the_file_s(folder, opened):
    series, tab = read_series(folder / "series.npz"), opened.tab
    tab.evaluate("page.choose({})")
    for scan in range(0, 121, 9):
        tab.evaluate("scan => page.goTo(scan)", scan)
        told = opened.values()
        for name in ("time", "returns", "covered", "position_rmse", "nees", "nis"):
            assert agrees(told[name], series["scans"][name][scan]), name
        heads = dict(
            zip(tab.locator(".chart h2").all_inner_texts(), tab.locator(".chart .values").all_inner_texts(), strict=True)
        )
        (text,) = (value for name, value in heads.items() if name.startswith("NEES"))
        if np.isfinite(series["scans"]["nees"][scan]):
            mean, low, high = re.fullmatch(r"(\S+) \(95 % band: (\S+) to (\S+)\)", text).groups()
            names = ("nees", "nees_low", "nees_high")
            assert all(
                agrees(part, series["scans"][name][scan]) for part, name in zip((mean, low, high), names, strict=True)
            )


def test_a_return_tells_whose_it_was(folder, opened):
    series, tab = read_series(folder / "series.npz"), opened.tab
    weights, entries = series["weights"], series["entries"]
    sure = np.flatnonzero((weights["weight"] > 0.5) & entries["confirmed"][weights["entry"]])[7]
    entry, own = weights["entry"][sure], int(weights["return"][sure])
    tab.evaluate(
        "([scan, own]) => { page.goTo(scan); page.choose({ return: page.data.scans.firstReturn[scan] + own }); }",
        [int(entries["scan"][entry]), own],
    )
    assert tab.locator("#chosen").inner_text().startswith(f"Return {own}")
    assert tab.locator("#details .list tbody tr").first.inner_text().split("\t")[0] == f"track {entries['track'][entry]}"


def test_layers_can_be_turned_off_and_the_map_moved(opened):
    tab = opened.tab
    tab.evaluate("page.choose({}); page.goTo(60)")
    picture = "document.getElementById('map').toDataURL()"
    before = tab.evaluate(picture)
    tab.locator("#layers label", has_text="returns").click()
    without = tab.evaluate(picture)
    assert without != before
    tab.locator("#layers label", has_text="returns").click()
    assert tab.evaluate(picture) == before
    tab.locator("#zoom-in").click()
    assert tab.evaluate(picture) != before
    tab.locator("#fit").click()
    assert tab.evaluate(picture) == before
    assert opened.said == []


def test_without_truth_nothing_is_compared_with_it(folder, tmp_path, running):
    head, *told = map(json.loads, (folder / "recording.jsonl").read_text().splitlines())
    scans = [{name: line[name] for name in line if name != "truth"} for line in told if "z" in line][:20]
    (tmp_path / "seen.jsonl").write_text("".join(json.dumps(each) + "\n" for each in [{**head, "truth": {}}, *scans]))
    line = ["run", str(EXAMPLES / "harbour.toml"), "--set", "source.kind=jsonl", "--stream", "--report"]
    assert main([*line, "--set", f"source.path={tmp_path / 'seen.jsonl'}", "--out", str(tmp_path)]) == 0
    seen = Opened(running, tmp_path / "report.html")
    assert "truth" not in seen.tab.locator("#layers").inner_text()
    seen.tab.evaluate("page.goTo(19)")
    assert seen.tab.locator("#details .list thead").inner_text().split() == ["track", "existence"]
    assert "covered" not in seen.tab.locator("#details").inner_text()
    assert seen.said == []


def test_sensors_can_be_filtered(tmp_path, running):
    from support.results import config

    (tmp_path / "given.json").write_text(json.dumps(config()))
    assert main(["run", str(tmp_path / "given.json"), "--out", str(tmp_path), "--stream", "--report"]) == 0
    both = Opened(running, tmp_path / "report.html")
    points = "() => page.charts.plots[0].spec.scans.length"
    count = both.tab.evaluate(points)
    both.tab.locator("#sensors label", has_text="radar").click()
    sensors = read_series(tmp_path / "series.npz")["scans"]["sensor"]
    assert count == len(sensors)
    assert both.tab.evaluate(points) == np.count_nonzero(sensors == 1)
    assert both.said == []


@pytest.mark.costly
def test_a_frame_lies_under_what_was_seen_in_it(tmp_path, running):
    line = ["run", str(EXAMPLES / "flir.toml"), "--set", "source.frames=12", "--out", str(tmp_path), "--stream", "--report"]
    assert main(line) == 0
    seen = Opened(running, tmp_path / "report.html")
    seen.tab.evaluate("page.goTo(7)")
    seen.wait("page.map.frameAt(7).image.complete && page.map.frameAt(7).scan === 7")
    seen.tab.evaluate("page.map.draw()")
    assert seen.said == []
    middle = "() => [...page.map.context.getImageData(page.map.px({0}), page.map.py({0}), 1, 1).data].slice(0, 3)"
    for place in (-20, 15):
        red, green, blue = seen.tab.evaluate(middle.replace("{0}", str(place + 0.3)))
        assert red == green == blue < 255, "a shade of grey"
    seen.tab.locator("#layers label", has_text="frames").click()
    assert seen.tab.evaluate(middle.replace("{0}", "-20.3")) == [255, 255, 255], "nothing is drawn there: white"


def test_a_sector_is_drawn_where_the_sensor_looks(opened):
    """Its corners, of a sensor at a place whose platform heads to 30 deg."""
    spy = """view => {
      const seen = [], { map, data } = page, own = map.context, { scans, facts } = data;
      page.goTo(60);
      const before = [facts.sensors.radar.view, scans.heading[60]];
      facts.sensors.radar.view = view;
      scans.heading[60] = Math.PI / 6;
      own.lineTo = (x, y) => seen.push(map.placeAt(x, y));
      drawView(map);
      delete own.lineTo;
      [facts.sensors.radar.view, scans.heading[60]] = before;
      return seen.map(([x, y]) => [x + facts.centre[0], y + facts.centre[1]]);
    }"""
    drawn = opened.tab.evaluate(spy, [{"closed": False, "rows": [[0.0, 100.0, 900.0], [0.5, 100.0, 900.0]]}])
    bearing, reach = np.pi / 6 + np.array([0.0, 0.5, 0.5, 0.0]), np.array([900.0, 900.0, 100.0, 100.0])
    np.testing.assert_allclose(drawn, np.stack([reach * np.cos(bearing), reach * np.sin(bearing)], axis=1), atol=1e-6)
    assert opened.tab.evaluate("page.data.facts.sensors.radar.view[0].rows[0].slice(1)") == [150, 3000]
    assert opened.said == []


def test_figures_of_the_summary_are_a_table(folder, opened):
    told = json.loads((folder / "summary.json").read_text())
    for name in ("position_rmse_m", "gospa_m", "nis", "coverage"):
        (cell,) = opened.tab.locator(f'[data-figure="{name}"] td').all_inner_texts()
        assert agrees(cell, told[name])
    cells = opened.tab.locator('[data-figure="ferry"] td').all_inner_texts()
    assert agrees(cells[1], told["truths"][0]["position_rmse_m"])
