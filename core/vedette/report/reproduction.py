"""A study's result for people and for programs: text, JSON, and its figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from vedette.report import canvas
from vedette.reproduction import Cell, Chart, Claim, Condition, Curve, Findings, Panel, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH = 118
_INCHES = 0.24
"""Height of a line of a claim."""
_LETTERS = 170
"""Letters of labels that one line above a chart holds, their marks reckoned as eight."""
_UNDER_TITLE = 0.38
"""Inches from the upper edge to the labels."""
_MANY = 300
"""Points of a line that is drawn thinner."""
_LEGEND: dict[str, Any] = {"frameon": False, "fontsize": 9, "labelcolor": canvas.INK}
_SHADES = {"reproduced": "#00724d", "not reproduced": "#b0413e", "not decided": "#8a6d00", "remark": canvas.SOFT}
_LOOKS: dict[str, dict[str, Any]] = {
    "line": {"linewidth": 1.5},
    "marked": {"linewidth": 1.5, "marker": "o", "markersize": 4.0},
    "dashed": {"linewidth": 1.5, "linestyle": (0, (5, 2))},
    "dots": {"linestyle": "none", "marker": ".", "markersize": 3.0, "alpha": 0.6},
    "rings": {"linestyle": "none", "marker": "o", "markersize": 13.0, "markerfacecolor": "none", "markeredgewidth": 2.0},
    "points": {"linestyle": "none", "marker": "o", "markersize": 5.0},
    "published": {"linestyle": "none", "marker": "D", "markersize": 7.0, "markerfacecolor": "none", "zorder": 4},
}


def text(result: Findings) -> str:
    """Return tables and verdicts, published figures beside measured ones."""
    lines = [result.title, f"{result.runs:,} runs, seed {result.seed}; +- is one Monte-Carlo standard error"]
    for table in (*result.tables, *result.machine):
        lines += ["", table.title, *wrap(table.note, _WIDTH), *rows(table)]
    lines += ["", "What the paper claims"]
    for claim in result.claims:
        lines += wrap(f"{verdict(claim)}: {claim.text}", _WIDTH, initial_indent="* ", subsequent_indent="  ")
        for condition in claim.conditions:
            lines += wrap(told(condition, claim.runs), _WIDTH, initial_indent="  - ", subsequent_indent="    ")
        lines += wrap(claim.why, _WIDTH, initial_indent="  ", subsequent_indent="  ")
    return "\n".join(lines)


def verdict(claim: Claim) -> str:
    """Return the verdict in capitals, and what would decide if nothing is decided yet."""
    head = claim.verdict.upper()
    if claim.verdict != "not decided":
        return head
    rest = "no number of them would decide" if claim.needed is None else f"{claim.needed:,} would decide"
    return f"{head} with {claim.runs:,} {claim.unit}, {rest}"


def told(condition: Condition, runs: int) -> str:
    """Return a condition's figure, its bounds, and whether it holds."""
    bounds = [f"{word} {bound:g}" for word, bound in (("at least", condition.least), ("at most", condition.most))]
    asked = " and ".join(words for words in bounds if "inf" not in words)
    held = {True: "holds", False: "fails", None: "open"}[condition.holds(runs)]
    value = "no figure" if condition.figure.measured is None else _measured(condition.figure)
    printed = "" if condition.figure.published is None else f" (published {condition.figure.published:g})"
    return f"{condition.what}: {value}{printed}, to be {asked}: {held}"


def rows(table: Table) -> Iterator[str]:
    """Yield the table, right-aligned: one line for each row, and one more under it where the paper printed figures."""
    lines: list[tuple[str, ...]] = [("", *table.columns)]
    for label, cells in table.rows:
        lines.append((label, *map(_measured, cells)))
        if any(cell.published is not None for cell in cells):
            lines.append(("  published", *("" if cell.published is None else f"{cell.published:g}" for cell in cells)))
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    for first, *rest in lines:
        yield "  ".join([first.ljust(widths[0]), *(part.rjust(width) for part, width in zip(rest, widths[1:], strict=True))])


def _measured(cell: Cell) -> str:
    if cell.measured is None:
        return "-"
    if cell.error is None or cell.error == 0:
        return f"{cell.measured:.4g}"
    places = int(np.clip(1 - np.floor(np.log10(cell.error)), 0, 6))
    return f"{cell.measured:.{places}f} +- {cell.error:.{places}f}"


def data(result: Findings) -> dict[str, Any]:
    """Return all but the figures as plain data."""
    return {
        "title": result.title,
        "runs": result.runs,
        "seed": result.seed,
        "tables": [
            {
                "title": table.title,
                "note": table.note,
                "rows": {
                    label: dict(zip(table.columns, map(attrs.asdict, cells), strict=True)) for label, cells in table.rows
                },
            }
            for table in (*result.tables, *result.machine)
        ],
        "claims": [_claim(claim) for claim in result.claims],
    }


def _claim(claim: Claim) -> dict[str, Any]:
    """Return a claim as plain data; a bound that a condition does not have is None, as JSON knows no infinity."""
    plain = attrs.asdict(claim)
    for condition, filled in zip(claim.conditions, plain["conditions"], strict=True):
        filled |= {name: bound if np.isfinite(bound := getattr(condition, name)) else None for name in ("least", "most")}
        filled["holds"] = condition.holds(claim.runs)
    return plain


def draw(chart: Chart) -> Figure:
    """Draw a chart: panels two by two, or a single one, and below them the claims with their verdicts."""
    count = len(chart.panels)
    columns = 1 if count == 1 else 2
    rows = -(-count // columns)
    lines = [wrap(f"{verdict(claim)}: {claim.text}", _WIDTH + 40) for claim in chart.claims]
    foot = _INCHES * (sum(map(len, lines)) + 1) if lines else 0.0
    labels = {tuple(curve.label for curve in panel.curves if curve.label) for panel in chart.panels} - {()}
    common = next(iter(labels)) if len(labels) == 1 else ()
    deep = max(1, -(-sum(len(label) + 8 for label in common) // _LETTERS))
    more = 0.1 + _INCHES * (deep - 1)
    made = canvas.figure((8.0 if count == 1 else 1.0 + 3.4 * rows) + foot + more, foot, more)
    drawn: list[Axes] = []
    for i, panel in enumerate(chart.panels):
        beside = drawn[0] if chart.shared and drawn else None
        drawn.append(made.add_subplot(rows, columns, i + 1, sharey=beside))
        _draw_panel(drawn[-1], panel)
    for axes, panel in zip(drawn, chart.panels, strict=True):
        if panel.log:
            _plain_numbers(axes)
    canvas.head(made, chart.title, "")
    if common:
        told = next(axes for axes in drawn if axes.get_legend_handles_labels()[1])
        at = (0.004, 1.0 - _UNDER_TITLE / made.get_figheight())
        columns = -(-len(common) // deep)
        made.legend(*told.get_legend_handles_labels(), loc="upper left", bbox_to_anchor=at, ncols=columns, **_LEGEND)
    else:
        for axes in drawn:
            _label_above(axes)
    _draw_claims(made, chart.claims, lines, foot)
    return made


def _label_above(axes: Axes) -> None:
    """Write a panel's labels above it, beside its title, where they hide nothing; inside if they are too many for that."""
    labels = axes.get_legend_handles_labels()[1]
    if not labels:
        return
    if len(axes.get_title(loc="left")) + sum(len(label) + 8 for label in labels) > 0.43 * _LETTERS:
        axes.legend(**_LEGEND)
    else:
        above = {"loc": "lower right", "bbox_to_anchor": (1.0, 1.0), "ncols": len(labels), "borderaxespad": 0.0}
        axes.legend(**above, **_LEGEND)


def _draw_claims(made: Figure, claims: Sequence[Claim], lines: Sequence[Sequence[str]], foot: float) -> None:
    height, y = made.get_figheight(), foot - _INCHES
    for claim, words in zip(claims, lines, strict=True):
        for line in words:
            made.text(0.012, y / height, line, fontsize=10, color=_SHADES[claim.verdict])
            y -= _INCHES


def _draw_panel(axes: Axes, panel: Panel) -> None:
    canvas.plain(axes)
    axes.set_title(panel.title, loc="left", fontsize=11, color=canvas.INK)
    axes.set(xlabel=panel.across, ylabel=panel.upright)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")
    if panel.log:
        axes.set_yscale("log")
    if panel.ticks:
        turned = max(map(len, panel.ticks)) * len(panel.ticks) > 60
        axes.set_xticks(
            range(len(panel.ticks)), panel.ticks, rotation=20 if turned else 0, ha="right" if turned else "center"
        )
    for i, curve in enumerate(panel.curves):
        _draw_curve(axes, curve, canvas.colour(i if curve.colour is None else curve.colour), panel.within)


def _plain_numbers(axes: Axes) -> None:
    """Write the numbers of a logarithmic axis as 20 and not as a product of powers, the closer the shorter it is."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    low, high = axes.get_ylim()
    steps = (1, 2, 3, 4, 5, 6, 8) if high < 8 * low else (1, 2, 5) if high < 200 * low else (1,)
    axes.yaxis.set_major_locator(LogLocator(subs=steps))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def _draw_curve(axes: Axes, curve: Curve, shade: str, within: tuple[float, float] | None) -> None:
    shade = {"dots": "#808080", "published": canvas.INK}.get(curve.style, shade)
    if curve.doubt is not None:
        low, high = np.clip([curve.y - curve.doubt, curve.y + curve.doubt], *(within or (-np.inf, np.inf)))
        if curve.doubt_across is not None or curve.style == "points":
            bars: dict[str, Any] = {"fmt": "none", "ecolor": shade, "elinewidth": 0.8, "capsize": 3.0}
            axes.errorbar(curve.x, curve.y, np.maximum([curve.y - low, high - curve.y], 0.0), curve.doubt_across, **bars)
        else:
            axes.fill_between(curve.x, low, high, color=shade, alpha=0.2, linewidth=0)
    look = _LOOKS[curve.style] | ({"linewidth": 0.9} if curve.style == "line" and len(curve.x) > _MANY else {})
    axes.plot(curve.x, curve.y, color=shade, label=curve.label or None, **look)
    for x, y, note in zip(curve.x, curve.y, curve.notes, strict=False):
        axes.annotate(note, (x, y), (6, -11), textcoords="offset points", fontsize=8.5, color=canvas.SOFT)
