"""The pages of runs and studies for those who read in the dark, by ear or without a mouse."""

from importlib.resources import files
from importlib.util import find_spec

import pytest

from support.browser import LACKING, Opened, browser
from support.paths import EXAMPLES
from vedette.cli import main

pytestmark = [pytest.mark.by_turns, pytest.mark.skipif(LACKING is not None, reason=str(LACKING))]
SERIOUS = "async () => (await axe.run()).violations.filter(({impact}) => /serious|critical/.test(impact)).map(({id}) => id)"
LIGHT = """(colour) => {
  const parts = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16) / 255);
  const [r, g, b] = parts.map((part) => part <= 0.04045 ? part / 12.92 : ((part + 0.055) / 1.055) ** 2.4);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b;
}"""


@pytest.fixture(scope="module")
def pages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    short = ["--set", "source.duration=60 s"]
    assert main(["run", str(EXAMPLES / "harbour.toml"), "--out", str(folder / "run"), "--report", *short]) == 0
    assert main(["study", str(EXAMPLES / "study.toml"), "--runs", "20", "--out", str(folder / "study")]) == 0
    assert main(["report", str(folder / "study")]) == 0
    return {name: folder / name / "report.html" for name in ("run", "study")}


@pytest.fixture(scope="module")
def running():
    with browser() as running:
        yield running


@pytest.fixture(params=["light", "dark"])
def opened(request, pages, running):
    return Opened(running, pages["run"], scheme=request.param)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", ["run", "study"])
@pytest.mark.costly
def test_axe_finds_nothing_serious(name, scheme, pages, running):
    if find_spec("axe_core_python") is None:
        pytest.skip("needs axe-core-python, which is not installed")
    opened = Opened(running, pages[name], scheme=scheme)
    opened.tab.evaluate(files("axe_core_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    assert opened.tab.evaluate(SERIOUS) == []
    assert opened.said == []


def test_the_page_opens_where_a_track_is_confirmed_and_returns_are_seen(opened):
    told = opened.tab.evaluate(
        "[page.data.scans.returns[page.state.scan], document.querySelectorAll('#details .list').length]"
    )
    assert told[0] > 0
    assert told[1] == 1


def test_slider_and_charts_say_what_they_show(opened):
    tab = opened.tab
    tab.locator("#slider").focus()
    tab.keyboard.press("End")
    last = tab.evaluate("page.data.scans.count")
    assert f"{last} of {last}" in tab.locator("#slider").get_attribute("aria-valuetext")
    labels = [chart.get_attribute("aria-label") for chart in tab.locator(".chart[role=img]").all()]
    assert len(labels) == tab.locator(".chart").count() > 2
    assert all(" from " in label for label in labels)


@pytest.mark.costly
def test_what_is_drawn_in_the_dark_has_a_contrast_of_4_5(pages, running):
    opened = Opened(running, pages["run"], scheme="dark")
    paper = opened.tab.evaluate(f"({LIGHT})(THEME.paper)")
    colours = opened.tab.evaluate(
        "[...page.data.facts.colours.tracks.map(legible), BLUE, THEME.ink, THEME.soft, THEME.accent]"
    )
    lights = [opened.tab.evaluate(f"({LIGHT})({colour!r})") for colour in colours]
    assert min((light + 0.05) / (paper + 0.05) for light in lights) >= 4.5


def test_dates_are_told_where_times_are_dates(opened):
    opened.tab.evaluate("page.data.scans.time[2] = 1533103200.25; page.data.facts.dated = true; page.goTo(2)")
    assert opened.values()["time"] == "2018-08-01T06:00:00.250Z"
    assert opened.tab.locator("#clock").inner_text().startswith("2018-08-01T06:00:00.250Z")
