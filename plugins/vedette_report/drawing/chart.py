"""The figures of a study: panels with their labels above, and below them the claims that they show."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np

from vedette_report.drawing import canvas
from vedette_report.findings import Chart, Claim, Curve, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH = 158
"""Letters of a line of a claim."""
_INCHES = 0.24
"""Height of a line of a claim."""
_LETTERS = 170
"""Letters of labels that one line above a chart of 12 inches holds, their marks reckoned as eight."""
_UNDER_TITLE = 0.38
"""Inches from the upper edge to the labels."""
_TICKS, _EDGE = 6, 0.09
"""Numbers on an axis of a map, at most: they may be as long as -2000; part of a map that stays free around what it shows."""
_MANY = 300
"""Points of a line that is drawn thinner."""
_OPEN = "#8a6d00"
_SHADES = {
    "reproduced": "#00527f",
    "not reproduced": "#b0413e",
    "not decided": _OPEN,
    "depends": _OPEN,
    "remark": canvas.SOFT,
}
_LOOKS: dict[str, dict[str, Any]] = {
    "line": {"linewidth": 1.5},
    "marked": {"linewidth": 1.5, "marker": "o", "markersize": 4.0},
    "dashed": {"linewidth": 1.5, "linestyle": (0, (5, 2))},
    "expected": {"linewidth": 1.0, "linestyle": (0, (5, 2)), "zorder": 1.5},
    "dots": {"linestyle": "none", "marker": ".", "markersize": 3.0, "alpha": 0.6},
    "rings": {"linestyle": "none", "marker": "o", "markersize": 13.0, "markerfacecolor": "none", "markeredgewidth": 2.0},
    "points": {"linestyle": "none", "marker": "o", "markersize": 5.0},
    "published": {"linestyle": "none", "marker": "D", "markersize": 7.0, "markerfacecolor": "none", "zorder": 4},
}
_OWN = {"dots": "#808080", "published": canvas.INK, "expected": canvas.SOFT}
"""Colours that a style has by itself."""


def draw(chart: Chart) -> Figure:
    """Draw a chart: panels two by two, or a single one; on a screen also the claims with their verdicts."""
    count = len(chart.panels)
    columns = canvas.across(min(count, 2))
    rows = -(-count // columns)
    claims = () if canvas.on_paper() else chart.claims
    lines = [wrap(f"{claim.headline}: {claim.text}", _WIDTH) for claim in claims]
    foot = _INCHES * (sum(map(len, lines)) + 1) if lines else 0.0
    labels = {tuple(curve.label for curve in panel.curves if curve.label) for panel in chart.panels} - {()}
    common = next(iter(labels)) if len(labels) == 1 else ()
    deep = _deep(common)
    more = _INCHES * (deep - 1) + 0.1 if not canvas.on_paper() or deep else 0.0
    if canvas.on_paper() and deep:
        more += _INCHES
    made = canvas.figure(7.38 if count == 1 else 0.38 + 3.4 * rows, min(count, 2), foot=foot, more=more)
    drawn: list[Axes] = []
    for i, panel in enumerate(chart.panels):
        beside = drawn[0] if chart.shared and drawn else None
        drawn.append(made.add_subplot(rows, columns, i + 1, sharey=beside))
        _draw_panel(drawn[-1], panel, _room(columns))
    for axes, panel in zip(drawn, chart.panels, strict=True):
        if panel.within is not None and not panel.log:
            _keep_within(axes, *panel.within)  # once all are drawn: panels may share their axis
        if panel.log:
            _plain_numbers(axes.yaxis, *axes.get_ylim())
        if panel.log_across:
            _plain_numbers(axes.xaxis, *axes.get_xlim())
    canvas.head(made, chart.title, "")
    if common:
        told = next(axes for axes in drawn if axes.get_legend_handles_labels()[1])
        down = canvas.letters(1.0) * (0.02 if canvas.on_paper() else _UNDER_TITLE)
        at = (0.004, 1.0 - down / made.get_figheight())
        made.legend(
            *told.get_legend_handles_labels(), loc="upper left", bbox_to_anchor=at, **_legend(-(-len(common) // deep))
        )
    else:
        for axes in drawn:
            _label_above(axes, columns)
    _draw_claims(made, claims, lines, foot)
    return made


def _room(panels: int) -> int:
    """Return how many letters of labels one line has above one of so many panels beside one another."""
    inches = canvas.width() * (1.0 if panels == 1 else 0.43)
    return int(_LETTERS * inches / 12.0 / canvas.letters(1.0))


def _deep(labels: Sequence[str]) -> int:
    """Return how many lines labels take above a chart; 0 if there are none."""
    if not labels:
        return 0
    deep = max(1, -(-sum(len(label) + 8 for label in labels) // _room(1)))
    columns = max(1, _room(1) // (max(map(len, labels)) + 8))
    return deep if deep == 1 else max(deep, -(-len(labels) // columns))


def _legend(columns: int) -> dict[str, Any]:
    return {**canvas.legend(9), "ncols": columns}


def _label_above(axes: Axes, panels: int) -> None:
    """Write a panel's labels above it, beside its title or, if they are long, below it: where they hide nothing."""
    labels = axes.get_legend_handles_labels()[1]
    if not labels:
        return
    title, room = axes.get_title(loc="left"), _room(panels)
    if len(title) + 4 + sum(len(label) + 8 for label in labels) <= room:
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.0, **_legend(len(labels)))
        return
    columns = max(1, min(len(labels), room // (max(map(len, labels)) + 8)))
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.0, **_legend(columns))
    deep = -(-len(labels) // columns)
    axes.set_title(title, loc="left", fontsize=canvas.letters(11), color=canvas.INK, pad=canvas.letters(6 + 15 * deep))


def _draw_claims(made: Figure, claims: Sequence[Claim], lines: Sequence[Sequence[str]], foot: float) -> None:
    text = canvas.letters(1.0)
    height, y = made.get_figheight(), text * (foot - _INCHES)
    for claim, words in zip(claims, lines, strict=True):
        for line in words:
            made.text(0.012, y / height, line, fontsize=canvas.letters(10), color=_SHADES[claim.verdict])
            y -= text * _INCHES


def _draw_panel(axes: Axes, panel: Panel, room: int) -> None:
    """Draw a panel that `room` letters go into, beside one another."""
    canvas.plain(axes)
    axes.set_title(panel.title, loc="left", fontsize=canvas.letters(11), color=canvas.INK)
    axes.set(xlabel=panel.across, ylabel=panel.upright)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
        axes.locator_params(nbins=_TICKS)
        axes.margins(_EDGE)
    if panel.log:
        axes.set_yscale("log")
    if panel.log_across:
        axes.set_xscale("log")
    if panel.ticks:
        turned = max(map(len, panel.ticks)) * len(panel.ticks) > 0.8 * room
        axes.set_xticks(
            range(len(panel.ticks)), panel.ticks, rotation=20 if turned else 0, ha="right" if turned else "center"
        )
        axes.set_xlim(-0.5, len(panel.ticks) - 0.5)
    elif not panel.log_across and not panel.equal and all(np.all(curve.x == np.rint(curve.x)) for curve in panel.curves):
        axes.xaxis.get_major_locator().set_params(integer=True)  # type: ignore[call-arg]
    for i, curve in enumerate(panel.curves):
        _draw_curve(axes, curve, canvas.colour(i if curve.colour is None else curve.colour), panel.within)


def _keep_within(axes: Axes, least: float, most: float) -> None:
    """End the upright axis little beyond the values that there can be; show all of them where there is but one."""
    low, high = axes.get_ylim()
    values = np.concatenate([np.asarray(line.get_ydata(), dtype=float) for line in axes.get_lines()] or [np.zeros(0)])
    known = values[np.isfinite(values)]
    if len(known) and np.ptp(known) == 0 and np.isfinite(most):
        low, high = least - (most - least), most + (most - least)
    edge = 0.02 * (min(high, most) - max(low, least))
    axes.set_ylim(max(low, least - edge), min(high, most + edge))


def _plain_numbers(axis: Any, low: float, high: float) -> None:
    """Write the numbers of a logarithmic axis as 20 and not as a product of powers, the closer the shorter it is."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    steps = (1, 2, 3, 4, 5, 6, 8) if high < 8 * low else (1, 2, 5) if high < 200 * low else (1,)
    axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def _look(curve: Curve) -> dict[str, Any]:
    """Return how a curve is drawn, in the sizes of the style."""
    look = _LOOKS[curve.style] | ({"linewidth": 0.9} if curve.style == "line" and len(curve.x) > _MANY else {})
    scales = {"linewidth": canvas.stroke, "markeredgewidth": canvas.stroke, "markersize": canvas.mark}
    return {name: scales[name](value) if name in scales else value for name, value in look.items()}


def _draw_curve(axes: Axes, curve: Curve, shade: str, within: tuple[float, float] | None) -> None:
    from matplotlib.patheffects import withStroke

    shade = _OWN.get(curve.style, shade)
    if curve.doubt is not None:
        low, high = np.clip([curve.y - curve.doubt, curve.y + curve.doubt], *(within or (-np.inf, np.inf)))
        if curve.doubt_across is not None or curve.style == "points":
            bars: dict[str, Any] = {"fmt": "none", "ecolor": shade, "elinewidth": canvas.stroke(0.8)}
            heights = np.maximum([curve.y - low, high - curve.y], 0.0)
            axes.errorbar(curve.x, curve.y, heights, curve.doubt_across, capsize=canvas.mark(3.0), **bars)
        else:
            axes.fill_between(curve.x, low, high, color=shade, alpha=0.2, linewidth=0)
    axes.plot(curve.x, curve.y, color=shade, label=curve.label or None, **_look(curve))
    halo = withStroke(linewidth=canvas.stroke(3.0), foreground="white")  # lines may go on below a note
    for x, y, note in zip(curve.x, curve.y, curve.notes, strict=False):
        words: dict[str, Any] = {"fontsize": canvas.letters(8.5), "color": canvas.SOFT, "path_effects": [halo]}
        up = 4 if y < np.mean(axes.get_ylim()) else -11
        axes.annotate(note, (x, y), (canvas.letters(6), canvas.letters(up)), textcoords="offset points", **words)
