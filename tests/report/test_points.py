"""Trackers that differ by name, beside one another with their errors; and charts whose words must not hide each other."""

from itertools import pairwise

import numpy as np
import pytest

import vedette
from support.paths import EXAMPLES
from vedette.config.files import read_file
from vedette_report.drawing import canvas
from vedette_report.drawing.chart import draw
from vedette_report.findings import Chart, Curve, Panel
from vedette_study.summary import charts

SWEPT = "estimator.motion.sigma_accel"


def study(**more):
    table = read_file(EXAMPLES / "study.toml")["experiment"]
    table["source"]["duration"] = 20
    return vedette.monte_carlo(table, 6, seed=3, **more)


@pytest.fixture(scope="module")
def found():
    return study(trackers={"pda": {}, "loose": {SWEPT: 1.0}, "nearest": {"associator": {"kind": "nearest"}}})


def test_each_figure_of_trackers_is_drawn_with_two_standard_errors(found):
    (chart,) = [chart for chart in charts(found) if chart.name == "points"]
    names = {"RMS position error [m]": "position_rmse", "NEES per axis": "nees", "NIS over what is expected": "nis"}
    panels = {panel.upright: panel for panel in chart.panels}
    assert {*names, "share of lost runs"} == set(panels)
    for upright, name in names.items():
        panel = panels[upright]
        means = [found.means(i)[name] for i in range(3)]
        assert panel.ticks == ("pda", "loose", "nearest")
        np.testing.assert_array_equal(panel.curves[0].x, [0, 1, 2])
        np.testing.assert_array_equal(panel.curves[0].y, [mean.value for mean in means])
        np.testing.assert_array_equal(panel.curves[0].doubt, [2 * mean.error for mean in means])
        assert np.ptp(panel.curves[0].y) > 0
    assert [len(panels[upright].curves) for upright in names] == [1, 2, 2], "what is expected of NEES and NIS is drawn"


def test_a_swept_number_has_curves_instead(found):
    assert [chart.name for chart in charts(study(sweep={SWEPT: [0.3, 1.0]}))] == ["time", "sweep_sigma_accel"]
    assert [chart.name for chart in charts(study())] == ["time"]


def boxes_of_names(axis):
    return [label.get_window_extent() for label in axis.get_ticklabels() if label.get_text() and label.get_visible()]


@pytest.mark.parametrize("columns", ["one", "two", "screen"])
@pytest.mark.by_turns
def test_numbers_on_a_map_stand_apart_and_a_note_stays_on_it(columns):
    places = np.array([[1900.0, -1990.0], [-2100.0, 1500.0]])
    curves = (Curve("truth", *places.T), Curve("", places[:1, 0], places[:1, 1], "points", 0, notes=("start",)))
    chart = Chart("maps", "Maps", (Panel("one", "east [m]", "north [m]", curves, equal=True),) * 3)
    with canvas.styled(canvas.Look(columns=columns)):
        made = draw(chart)
        made.draw_without_rendering()
        for axes in made.axes:
            across = boxes_of_names(axes.xaxis)
            assert len(across) > 2
            assert all(left.x1 + 2 < right.x0 for left, right in pairwise(across))
            note, frame = axes.texts[0].get_window_extent(), axes.get_window_extent()
            assert frame.x0 < note.x0 < note.x1 < frame.x1 + 0.1 * frame.width
            assert frame.y0 < note.y0 < note.y1 < frame.y1


@pytest.mark.parametrize(("name", "turned"), [("boat", False), ("a tracker with a name of many words", True)])
def test_names_below_a_panel_are_turned_only_where_they_have_no_room(name, turned):
    spots = np.arange(3.0)
    panel = Panel("", "", "error [m]", (Curve("", spots, spots + 1, "points", doubt=spots),), ticks=(name,) * 3)
    with canvas.styled(canvas.Look(columns="two")):
        (axes,) = draw(Chart("names", "Names", (panel,))).axes
    assert {label.get_rotation() != 0 for label in axes.get_xticklabels()} == {turned}
    assert axes.get_xlim() == (-0.5, 2.5)
