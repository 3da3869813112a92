"""The live page in a real Chromium: it shows each scan as it comes, every value that of the file, and stays at the end."""

import os
from pathlib import Path
from time import sleep, time

import numpy as np
import pytest

import vedette
from support.browser import LACKING, browser
from support.results import config
from vedette_files import read_series
from vedette_report.running.streaming import stream
from vedette_report.watching import records
from vedette_report.watching.page import LivePage
from vedette_report.watching.real_time import Pace

pytestmark = [pytest.mark.costly, pytest.mark.skipif(LACKING is not None, reason=str(LACKING))]
HALF = 20
NONE = "\N{EN DASH}"


class Watched:
    """A run that stops after some scans until it is told to go on, and a tab with its page."""

    def __init__(self, running, folder, size=(1400, 900)):
        self.experiment = vedette.load(config())
        pace = self.pace = Pace(float("inf"))
        self.steps, self.folder = self.experiment.steps(progress=pace), folder
        self.live = LivePage(self.experiment, self.steps.recording, self.steps.state, lambda: pace.came)
        self.told = []
        stream(self.experiment, folder, steps=self.steps, shown=lambda *told: self.told.append(told))
        self.sent = 0
        self.tab = running.new_page(viewport=dict(zip(("width", "height"), size, strict=True)))
        self.tab.set_default_timeout(30_000)
        self.said, self.asked = [], []
        self.tab.on("console", lambda message: self.said.append(message.text))
        self.tab.on("pageerror", lambda error: self.said.append(str(error)))
        self.tab.on("request", lambda request: self.asked.append(request.url))
        self.tab.goto(self.live.server.address)

    def send(self, until):
        for told in self.told[self.sent : until]:
            self.pace.came = time()
            self.live.take(*told)
            sleep(0.01)
        self.sent = min(until, len(self.told))
        self.wait(f"window.page && live.shown === {self.sent - 1}")

    def wait(self, condition):
        for _ in range(1000):
            if self.tab.evaluate(f"Boolean({condition})"):
                return
            self.tab.wait_for_timeout(20)
        raise AssertionError(f"it never came true: {condition}; {self.said}")

    def values(self):
        self.tab.evaluate("page.details.show()")
        cells = "[...document.querySelectorAll('[data-value]')].map((cell) => [cell.dataset.value, cell.textContent])"
        return dict(self.tab.evaluate(cells))


@pytest.fixture(scope="module")
def running():
    with browser() as running:
        yield running


@pytest.fixture(scope="module")
def watched(running, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(records, "_SHARE", 1.0)
        patch.setattr(records, "_PAUSE", np.inf)
        own = Watched(running, tmp_path_factory.mktemp("watched"))
        own.send(HALF)
        yield own
        own.live.end(interrupted=False, wait=0.5)


def near(text, value):
    return text == NONE if not np.isfinite(value) else abs(float(text) - value) <= 1e-3 * abs(value) + 1e-9


def test_it_shows_the_last_scan_with_the_values_of_the_file(watched):
    series, scan = read_series(watched.folder / "series.npz"), HALF - 1
    told = watched.values()
    assert watched.tab.locator("#details h2").inner_text() == f"Scan {HALF} of {HALF}"
    for name in ("time", "returns", "covered", "position_rmse", "nees", "nis"):
        assert near(told[name], float(series["scans"][name][scan])), name
    entries = series["entries"]
    own = (entries["scan"] == scan) & entries["confirmed"]
    assert own.any()
    for row in np.flatnonzero(own).tolist():
        watched.tab.evaluate("(id) => page.choose({ track: page.data.tracks.id.indexOf(id) })", int(entries["track"][row]))
        told = watched.values()
        for name in ("position_error", "position_sigma", "nees", "nis_given_hit", "existence", "mode0", "mode1"):
            assert near(
                told[name], float(entries[name][row] if "mode" not in name else entries["modes"][row, int(name[4])])
            ), name
        assert abs(float(told["x"].split(" ")[0]) - entries["mean"][row, 0]) < 0.06
        assert watched.tab.locator("#weights tbody tr").count() > 1
    watched.tab.evaluate("page.choose({})")


def test_it_asks_for_its_own_address_alone_and_says_nothing(watched):
    address = watched.live.server.address
    assert set(watched.asked) == {address, f"{address}events"}
    assert watched.said == []


COMPARED = """() => {
  const { width, height } = page.map.still;
  const seen = () => {
    const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
    copy.drawImage(page.map.still, 0, 0);
    return copy.getImageData(0, 0, width, height).data;
  };
  const before = seen();
  page.map.stale = true;
  page.map.draw();
  const after = seen(), far = after.filter((value, i) => Math.abs(value - before[i]) > 60).length;
  return [far, after.filter((value) => value > 0).length];
}"""


def test_paths_drawn_scan_by_scan_are_those_drawn_at_once(watched):
    watched.send(HALF + 2)
    far, drawn = watched.tab.evaluate(COMPARED)
    assert drawn > 2000
    assert far < 0.02 * drawn


CHARTS = "page.charts.plots.map(({ chart, spec }) => [spec.title, spec.scans.length, chart.data.map((one) => [...one])])"


def test_charts_that_go_on_are_those_made_anew_and_reach_the_last_scan(watched):
    watched.send(HALF + 4)
    watched.wait(f"page.charts.plots.length && page.charts.plots.every(({{ spec }}) => spec.scans.length === {HALF + 4})")
    made = "page.charts.plots.map(({ chart }) => chart)"
    watched.tab.evaluate(f"window.kept = {made}")
    watched.send(HALF + 5)
    watched.wait(f"page.charts.plots.every(({{ spec }}) => spec.scans.length === {HALF + 5})")
    assert watched.tab.evaluate(f"{made}.every((chart, i) => chart === window.kept[i])")
    went_on = watched.tab.evaluate(CHARTS)
    watched.tab.evaluate("page.charts.rebuild()")
    assert watched.tab.evaluate(CHARTS) == went_on
    assert len(went_on) == 4


def test_the_delay_of_every_scan_after_the_first_picture_is_known(watched):
    watched.wait("live.came.length === 0")
    told = watched.tab.evaluate("live.stats")
    after = watched.tab.evaluate(
        "Array.from(page.data.scans.came.subarray(0, page.data.scans.count)).filter(t => 1000 * t > live.stats.first).length"
    )
    assert 0 < after == len(told["delays"])
    assert min(told["delays"]) > 0


def test_a_line_goes_on_over_scans_that_were_not_compared(watched):
    tab = watched.tab
    tab.evaluate("page.kept = page.data.scans.covered.slice(); page.data.scans.covered.fill(NaN, 3)")
    assert tab.evaluate("() => { live.drawCharts(); return page.charts.plots.at(-1).chart.series.at(-1).spanGaps; }")
    tab.evaluate("page.data.scans.covered.set(page.kept)")


def test_who_looks_back_stays_there_until_the_button_takes_him_on(watched):
    tab = watched.tab
    tab.locator("#slider").focus()
    tab.keyboard.press("Home")
    assert tab.locator("#details h2").inner_text().startswith("Scan 1 of")
    watched.send(HALF + 6)
    tab.wait_for_timeout(250)
    assert tab.evaluate("page.state.scan") == 0
    assert tab.locator("#follow").get_attribute("aria-pressed") == "false"
    tab.locator("#follow").click()
    watched.wait(f"page.state.scan === {HALF + 5}")
    tab.locator("#play").click()
    assert not tab.evaluate("live.following"), "pause"
    tab.locator("#follow").click()


ENDS = """() => page.data.tracks.id.map(
  (id, t) => [id, page.data.entries.x[page.data.tracks.rows[t].at(-1)], page.data.tracks.colour[t]])"""
FORGET = "() => { const n = page.data.scans.count; page.data.forget(); live.moved(n - page.data.scans.count); }"


def test_letting_go_of_old_scans_changes_nothing_of_the_others(watched):
    watched.send(HALF + 8)
    before, ends = watched.values(), {row[0]: row[1:] for row in watched.tab.evaluate(ENDS)}
    watched.tab.evaluate(FORGET)
    left = watched.tab.evaluate("page.data.scans.count")
    assert left < 15
    after = {row[0]: row[1:] for row in watched.tab.evaluate(ENDS)}
    assert len(after) > 1
    assert {number: ends[number] for number in after} == after
    assert watched.values() == before
    watched.send(HALF + 10)
    assert watched.tab.evaluate("page.data.scans.count") == left + 2
    watched.values()
    assert watched.tab.locator("#details h2").inner_text() == f"Scan {left + 2} of {left + 2}"


def test_at_the_end_it_says_so_and_stays(watched):
    watched.send(len(watched.told))
    watched.live.end(interrupted=False)
    watched.wait("document.documentElement.dataset.ended === 'ended'")
    assert watched.tab.locator("#live").inner_text() == f"ended · {len(watched.told)} scans"
    watched.tab.locator("#slider").focus()
    watched.tab.keyboard.press("Home")
    assert watched.tab.evaluate("page.state.scan") == 0
    watched.tab.keyboard.press("End")
    watched.tab.wait_for_timeout(100)
    assert watched.said == []
    stats = watched.tab.evaluate("live.stats")
    assert (stats["received"], stats["lost"]) == (len(watched.told), 0)
    watched.tab.screenshot(path=Path(os.environ.get("VEDETTE_PICTURES", watched.folder)) / "watch_ended.png")


def test_on_a_phone_nothing_scrolls_sideways(running, tmp_path):
    own = Watched(running, tmp_path, (390, 844))
    own.send(len(own.told))
    assert own.tab.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    path = Path(os.environ.get("VEDETTE_PICTURES", tmp_path)) / "watch_phone.png"
    own.tab.screenshot(path=path)
    own.live.end(interrupted=True)
    own.wait("document.documentElement.dataset.ended === 'interrupted'")
    assert own.said == []
