"""The pictures of a study: labels hide nothing, bands end where values end, scales are shared, logarithmic axes are read."""

import numpy as np
import pytest

from vedette_report.drawing.chart import draw
from vedette_report.findings import Cell, Chart, Curve, Panel, Table
from vedette_study.panels import comparison, mean_over_runs, mode_panel

X = np.arange(40.0)


def panel(title, *curves, **more):
    return Panel(title, "time [s]", "error [m]", curves, **more)


def line(label, level=1.0, **more):
    return Curve(label, X, level + np.sin(X), **more)


LONG = "the standard deviation that a filter states of its own errors"


@pytest.mark.parametrize(
    "labels",
    [
        [("one", "two"), ("one", "two"), ("one", "two")],  # one row for all
        [(LONG, LONG + "!"), (LONG, LONG + "!")],  # two rows
        [("one", "two"), ("three", "four")],  # above each panel
        [("one",), ()],  # only the first says which is which
        [("one", "two")],
    ],
)
@pytest.mark.by_turns
def test_labels_cover_no_curve_and_no_title(labels):
    panels = tuple(panel(f"panel {i}", *(line(each, k) for k, each in enumerate(names))) for i, names in enumerate(labels))
    made = draw(Chart("name", "A title", panels))
    made.draw_without_rendering()
    told = [*made.legends, *(axes.get_legend() for axes in made.axes if axes.get_legend())]
    assert {text.get_text() for each in told for text in each.get_texts()} == {each for names in labels for each in names}
    for each in told:
        box = each.get_window_extent()
        assert 0 <= box.x0 < box.x1 <= made.bbox.x1
        assert box.y1 <= made.bbox.y1 - 30  # under the chart's title
        for axes in made.axes:
            assert not box.overlaps(axes.get_window_extent().padded(-1))
            assert not box.overlaps(axes.title.get_window_extent())
            assert not box.overlaps(axes._left_title.get_window_extent().padded(-1))


def test_bands_and_bars_end_where_values_end():
    share = np.array([0.0, 1.0, 100.0])
    for style in ("line", "points"):
        curve = Curve("", np.arange(3.0), share, style, doubt=np.full(3, 5.0))
        for within, ends in ((None, (-5.0, 105.0)), ((0.0, 100.0), (0.0, 100.0))):
            (axes,) = draw(Chart("name", "A title", (panel("", curve, within=within),))).axes
            drawn = np.concatenate([path.vertices[:, 1] for part in axes.collections for path in part.get_paths()])
            assert (drawn.min(), drawn.max()) == ends


def test_shared_panels_show_every_value_where_there_are_limits():
    panels = tuple(panel("", Curve("", X, most * X / X[-1]), within=(0.0, 1.0)) for most in (0.5, 0.9, 0.3))
    low, high = draw(Chart("name", "A title", panels, shared=True)).axes[0].get_ylim()
    assert low <= 0 < 0.9 <= high


def test_shared_panels_have_one_scale():
    panels = panel("low", line("", 1.0)), panel("high", line("", 100.0))
    for shared in (False, True):
        low, high = (axes.get_ylim() for axes in draw(Chart("name", "A title", panels, shared=shared)).axes)
        assert (low == high) is shared
        assert high[1] > 100


@pytest.mark.parametrize(("low", "high"), [(3.0, 10.0), (2.0, 35.0), (5.0, 530.0), (1e-4, 5.0)])
@pytest.mark.by_turns
def test_a_logarithmic_axis_has_numbers_enough(low, high):
    curve = Curve("", np.arange(2.0), np.array([low, high]))
    made = draw(Chart("name", "A title", (panel("", curve, log=True), panel("", curve, log=True))))
    made.draw_without_rendering()
    for axes in made.axes:
        below, above = axes.get_ylim()
        told = [text.get_text() for text in axes.get_yticklabels() if below <= text.get_position()[1] <= above]
        assert 3 <= len([each for each in told if each]) <= 8
        assert all(float(each) > 0 for each in told if each)
        assert not [text for text in axes.get_yticklabels(minor=True) if text.get_text()]


def test_published_marks_are_named_once_and_last():
    rows = tuple((name, (Cell(1.0, 0.1, 2.0), Cell(3.0, 0.1, 4.0))) for name in ("ours", "theirs"))
    made = comparison(Table("Errors", ("total", "straight"), rows), ("total", "straight"), "m")
    assert [curve.label for curve in made.curves] == ["total", "straight", "published", ""]
    np.testing.assert_array_equal(made.curves[3].y, [4.0, 4.0])
    np.testing.assert_array_equal(made.curves[3].x, made.curves[1].x)


def test_modes_are_called_by_their_names():
    modes = np.linspace([0.9, 0.1], [0.2, 0.8], len(X))
    made = mode_panel("IMM", "time [s]", X, modes, ("straight", "turn"))
    assert [curve.label for curve in made.curves] == ["straight", "turn"]
    np.testing.assert_array_equal(made.curves[1].y, modes[:, 1])
    with pytest.raises(ValueError, match="zip"):
        mode_panel("IMM", "time [s]", X, modes, ("straight",))


def test_bands_of_mode_probabilities_are_two_standard_errors_of_their_mean():
    modes = np.random.default_rng(1).dirichlet([2.0, 3.0], size=(50, len(X)))
    mean, doubt = mean_over_runs(modes)
    np.testing.assert_allclose(mean, modes.mean(axis=0))
    np.testing.assert_allclose(doubt, 2 * np.sqrt(((modes - mean) ** 2).sum(axis=0) / 49 / 50))
    made = mode_panel("IMM", "time [s]", X, mean, ("straight", "turn"), doubt)
    np.testing.assert_array_equal(made.curves[1].doubt, doubt[:, 1])
    assert not mean_over_runs(modes[:1])[1].any()


def test_an_axis_shows_the_values_that_there_can_be_and_no_others():
    share = Curve("", X, np.zeros(len(X)))
    for within, ends in (((0.0, 100.0), (-2.0, 102.0)), (None, None)):
        low, high = draw(Chart("name", "A title", (panel("", share, within=within),))).axes[0].get_ylim()
        assert (low, high) == (ends or (low, high))
        assert low < -0.01
    rising = draw(Chart("name", "A title", (panel("", Curve("", X, X), within=(0.0, np.inf)),))).axes[0].get_ylim()
    assert -1.0 < rising[0] <= 0.0
    assert rising[1] > X[-1]


def test_sweeps_have_a_logarithmic_axis_with_plain_numbers():
    made = draw(Chart("name", "A title", (panel("", Curve("", X + 0.1, X), log_across=True),)))
    made.draw_without_rendering()
    assert made.axes[0].get_xscale() == "log"
    told = [text.get_text() for text in made.axes[0].get_xticklabels()]
    assert {"0.1", "1", "10"} <= set(told)


def test_whole_numbers_have_ticks_at_whole_numbers():
    """A sweep of 2 and 3 hits has no 2.25, and one of 0.1 to 0.3 keeps its parts."""
    for values in ([2.0, 3.0], [1.0, 2.0, 4.0], [0.1, 0.3]):
        curve = Curve("", np.array(values), np.ones(len(values)))
        made = draw(Chart("name", "A title", (panel("hits", curve),)))
        low, high = made.axes[0].get_xlim()
        ticks = [tick for tick in made.axes[0].get_xticks() if low <= tick <= high]
        assert len(ticks) >= 2
        assert all(float(tick).is_integer() for tick in ticks) == (values[0] >= 1)
