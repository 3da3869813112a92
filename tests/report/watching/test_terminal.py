"""The view in the terminal: the tracks with their numbers, on a map and in a list."""

import re
from io import StringIO

import pytest

import vedette
from support.results import config
from vedette.errors import ConfigError
from vedette_report.watching.real_time import Pace
from vedette_report.watching.terminal import TerminalView

rich = pytest.importorskip("rich.console", reason="needs rich, which is not installed")


def shown(width=100, height=40, **changes):
    """What is on the screen at the end of a run, its states and the view."""
    console = rich.Console(file=StringIO(), width=width, height=height, force_terminal=True, color_system=None)
    experiment = vedette.load(config(**changes))
    pace = Pace(float("inf"))
    steps = experiment.steps(progress=pace)
    view = TerminalView(experiment, steps, pace, console)
    for scan, state in steps:
        view.take(scan, steps.before, state, experiment.tracker.estimate(state), None)
    view.end(interrupted=False)
    console.file.seek(0)
    console.file.truncate()
    console.print(view._picture())
    return console.file.getvalue(), state, experiment, view


def test_each_confirmed_track_is_listed_with_its_estimate_and_stands_on_the_map():
    text, state, experiment, view = shown()
    lines = text.splitlines()
    assert lines[0] == "A test"
    assert f"scan {view.scans} of" in lines[1]
    estimate = experiment.tracker.estimate(state).mean[state.confirmed]
    assert len(estimate) == 2
    for number, mean in zip(state.ids[state.confirmed], estimate, strict=True):
        (row,) = (line for line in lines if re.match(rf"\s+{number}\s+{re.escape(f'{mean[0]:.5g}')}\s", line))
        assert f"{mean[1]:.5g}" in row
    table = next(i for i, line in enumerate(lines) if "characters" in line)
    marks = "".join(lines[2:table])
    assert sorted(re.findall(r"\d+", marks)) == sorted(str(number) for number in state.ids[state.confirmed])


def test_north_is_up_and_each_axis_has_the_scale_that_is_told():
    text, state, experiment, _ = shown()
    lines = text.splitlines()
    across, upright = (float(re.search(rf"([\d.e+]+) m for 10 {what}", text)[1]) / 10 for what in ("characters", "lines"))
    found = {}
    for number in state.ids[state.confirmed].tolist():
        row = next(i for i, line in enumerate(lines[2:22]) if re.search(rf"\b{number}\b", line))
        found[number] = (lines[2 + row].index(str(number)) * across, -row * upright)
    first, second = (np_mean[:2] for np_mean in experiment.tracker.estimate(state).mean[state.confirmed])
    one, two = found.values()
    assert one[0] - two[0] == pytest.approx(first[0] - second[0], abs=1.5 * across)
    assert one[1] - two[1] == pytest.approx(first[1] - second[1], abs=1.5 * upright)


def test_a_small_terminal_says_how_many_are_left_out():
    text, *_ = shown(width=30, height=9)
    assert max(map(len, text.splitlines())) <= 30


def test_without_rich_it_says_what_to_install(monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "rich.live", None)
    experiment = vedette.load(config())
    with pytest.raises(ConfigError, match=r"--terminal: needs rich: pip install 'vedette\[report\]'"):
        TerminalView(experiment, experiment.steps(), Pace())
