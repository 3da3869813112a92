"""Errors against covariances over time: the picture of a tracker's consistency."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vedette.space import Array
from vedette_report.drawing import canvas

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from vedette_report.whole_trackers.judging import Report

MOST = 8
"""Directions that are drawn."""


def drawn(report: Report) -> Figure:
    """Draw NEES, the NIS of each sensor and the scale of the covariance along each direction, a panel each.

    1 is expected of all. Each has the band of one point where that is known, else two standard errors around it, and between
    dashes the band of the verdict, which is on the mean over time.
    """
    panels = 2 + len(report.nis)
    many = len(report.directions[:MOST])
    made = canvas.figure(canvas.stacked(panels), words=0.3 * -(-(many + 2) // max(3, canvas.across(5))))
    places = made.subplots(panels, 1, sharex=True)
    verdict = "consistent" if report.consistent else "not consistent" if report.wrong else "not shown to be consistent"
    canvas.head(made, f"The tracker is {verdict}", f"{report.runs} runs, false-alarm rate {report.alpha:g} in all")
    series = [("NEES", report.nees, report.errors["nees"], np.array(report.nees_band)[:, None])]
    series += [(f"NIS of {name}", values, report.errors[name], report.nis_band[name]) for name, values in report.nis.items()]
    for axes, (name, values, error, band) in zip(places, series, strict=False):
        axes.plot(report.times, values, color=canvas.colour(0), linewidth=canvas.stroke(1.2))
        low, high = band if report.exact else (values - 2 * error, values + 2 * error)
        _band(axes, report.times, low, high)
        if not report.exact:
            (judged,) = (one for one in report.verdicts if one.name in (name, f"{name}, mean over a run"))
            for edge in (judged.low, judged.high):
                axes.axhline(edge, **_dashes())
        axes.set_ylabel(f"{name} over\nwhat is expected")
    low_axes = places[-1]
    for i, name in enumerate(report.directions[:MOST]):
        shade, values = canvas.colour(i), report.calibration[i]
        low_axes.plot(report.times, values, color=shade, linewidth=canvas.stroke(1.2), label=name)
        if not report.exact:
            doubt = 2 * report.errors["calibration"][i]
            low_axes.fill_between(report.times, values - doubt, values + doubt, color=shade, alpha=0.2, linewidth=0)
    if report.exact:
        _band(low_axes, report.times, *np.array(report.calibration_band)[:, None])
    low_axes.set(xlabel="time [s]", ylabel="squared error\nover variance")
    _explain(made, low_axes, report)
    for axes in places:
        axes.axhline(1.0, color=canvas.INK, linewidth=canvas.stroke(0.8))
        canvas.plain(axes)
    return made


def _band(axes: Axes, times: Array, low: Array, high: Array) -> None:
    """Shade the band between two edges (s,) or (1,)."""
    edges = np.broadcast_to(low, times.shape), np.broadcast_to(high, times.shape)
    axes.fill_between(times, *edges, color=canvas.FAINT, alpha=0.8, linewidth=0, zorder=0)


def _dashes() -> dict[str, Any]:
    return {"color": canvas.SOFT, "linestyle": "--", "linewidth": canvas.stroke(0.8)}


def _explain(made: Figure, axes: Axes, report: Report) -> None:
    """Write below all panels which curve is which direction, and what the bands are."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    handles, names = axes.get_legend_handles_labels()
    handles.append(Patch(color=canvas.FAINT))
    names.append("band of one point" if report.exact else "two standard errors of one point")
    if not report.exact:
        handles.append(Line2D([], [], **_dashes()))
        names.append("band of the mean over time, which is judged")
    columns = min(len(names), max(3, canvas.across(5)))
    made.legend(handles, names, loc="outside lower center", ncols=columns, **canvas.legend(9))
