"""How well the data tell each tuned parameter, and how the gain grew: the picture of `vedette tune`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_report.drawing import canvas

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = {1: 1, 2: 2, 4: 2}
"""Panels beside one another for so many parameters; else three."""


@frozen(eq=False)
class Hill:
    """The criterion (c,) below its top at `values` (c,) of one parameter; `band`: of one standard error."""

    name: str
    unit: str
    values: Array
    heights: Array
    parabola: Array | None
    before: float | None
    after: float
    band: tuple[float, float] | None
    logarithmic: bool
    told: str


@frozen(eq=False)
class Growth:
    """The log-likelihood's gain (s,), summed over the scans at `times` (s,), the first `tuned` of which were tuned on."""

    times: Array
    gain: Array
    tuned: int


def draw(
    title: str, facts: str, hills: Sequence[Hill], growth: Growth | None, path: Path, look: canvas.Look | None = None
) -> None:
    """Write a picture: the criterion along each parameter with the band of one standard error, and the gain over time."""
    with canvas.styled(look):
        canvas.save(_drawn(title, facts, hills, growth), path)


def _drawn(title: str, facts: str, hills: Sequence[Hill], growth: Growth | None) -> Figure:
    columns = canvas.across(COLUMNS.get(len(hills), 3))
    rows = -(-len(hills) // columns)
    made = canvas.figure(3.1 * rows + (2.9 if growth is not None else 0.0), words=0.4 * rows)
    grid = made.add_gridspec(rows + (growth is not None), columns)
    canvas.head(made, title, facts)
    for i, hill in enumerate(hills):
        _hill(made.add_subplot(grid[i // columns, i % columns]), hill)
    if growth is not None:
        axes, begin = made.add_subplot(grid[rows, :]), float(growth.times[0])
        axes.plot(growth.times - begin, np.cumsum(growth.gain), color=canvas.colour(0), linewidth=canvas.stroke(1.4))
        axes.axhline(0.0, color=canvas.INK, linewidth=canvas.stroke(0.8))
        if growth.tuned < len(growth.times):
            held = float(growth.times[growth.tuned]) - begin, float(growth.times[-1]) - begin
            axes.axvspan(*held, color=canvas.FAINT, alpha=0.6, linewidth=0, label="held back")
            axes.legend(loc="upper left", **canvas.legend(9.0))
        axes.set(xlabel="time [s]", ylabel="gain in log-likelihood\nover the config's values")
    for each in made.axes:
        canvas.plain(each)
    return made


def _hill(axes: Axes, hill: Hill) -> None:
    shown = np.isfinite(hill.heights)
    if hill.logarithmic:
        axes.set_xscale("log")
    if hill.band is not None:
        axes.axvspan(*hill.band, color=canvas.FAINT, alpha=0.8, linewidth=0)
    line: dict[str, Any] = {"linewidth": canvas.stroke(1.4), "markersize": canvas.mark(5.0)}
    axes.plot(hill.values[shown], hill.heights[shown], ".-", color=canvas.colour(0), **line)
    if hill.parabola is not None:
        axes.plot(hill.values, hill.parabola, color=canvas.SOFT, linewidth=canvas.stroke(1.0), linestyle=":")
    axes.axvline(hill.after, color=canvas.colour(0), linewidth=canvas.stroke(1.0))
    low, high = float(np.min(hill.values)), float(np.max(hill.values))
    if hill.before is not None and low <= hill.before <= high:
        axes.axvline(hill.before, color=canvas.colour(1), linewidth=canvas.stroke(1.2), linestyle="--")
    elif hill.before is not None:
        left = hill.before < low
        said = f"\u2190 was {hill.before:.3g}" if left else f"was {hill.before:.3g} \u2192"
        place: dict[str, Any] = {"transform": axes.transAxes, "ha": "left" if left else "right"}
        axes.text(0.02 if left else 0.98, 0.9, said, fontsize=canvas.letters(9.0), color=canvas.colour(1), **place)
    unit = "" if hill.unit == "1" else f" [{hill.unit}]"
    axes.set_title(f"{hill.name}{unit}", fontsize=canvas.letters(9.5), loc="left", color=canvas.INK)
    axes.set_xlabel(hill.told)
    least = float(np.min(hill.heights[shown], initial=0.0))
    axes.set_ylim(1.12 * min(least, -0.5), -0.06 * min(least, -0.5))
