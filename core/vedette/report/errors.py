"""The picture of errors: how large they are, whether the covariances fit, and the mode probabilities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vedette.experiment import Experiment, Result
from vedette.report import canvas
from vedette.report.figures import length_unit
from vedette.report.traces import Normalised, Trace, band, innovations, mode_names, nis_of_expected, position_nees, traces
from vedette.space import Array, Mask

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 6
"""Number of true objects with a row of their own; the others still count in the NEES."""

_GAP = "#f6c8c0"


def errors(experiment: Experiment, result: Result) -> Figure:
    """Draw errors against time, a row for each true object; then NEES and NIS against their bands. 1200 px wide."""
    followed, seen = traces(experiment, result), innovations(experiment, result)
    shown, begin = followed[:_MOST], result.scans[0].time if result.scans else 0.0
    modes = next((track.mode_prob.shape[1] for track in result.tracks if track.mode_prob is not None), 0)
    made = canvas.figure(height=max(9.0, 2.2 * (len(shown) + 1) + 1.4) if shown else 6.0)
    grid = made.add_gridspec(len(shown) + 1, 6)
    width = 2 if modes else 3
    for i, trace in enumerate(shown):
        places = [made.add_subplot(grid[i, k : k + width]) for k in range(0, 6, width)]
        _show_object(places, trace, begin, length_unit(experiment))
    if followed:
        nees = position_nees(followed)
        told = f"{np.mean(nees.value):.3g} on average, {np.mean(nees.axes):.3g} expected" if len(nees.value) else ""
        _show_normalised(made.add_subplot(grid[-1, :3]), nees, begin, "NEES of the position", told)
    told = f"{nis_of_expected(experiment, result) or 0.0:.3g} of what is expected"
    _show_normalised(made.add_subplot(grid[-1, 3 if followed else 0 :]), seen, begin, "NIS", told)
    end = (result.scans[-1].time - begin if result.scans else 0.0) or 1.0
    for each in made.axes:
        canvas.plain(each)
        each.set_xlim(-0.01 * end, 1.01 * end)
    for each in made.axes[-2:]:
        each.set_xlabel("time since the first scan [s]")
    facts = "lines and dots have the colours of the tracks in picture.png"
    if len(followed) > len(shown):
        facts += f"   ·   the first {len(shown)} of {len(followed)} true objects; NEES and NIS are of all"
    canvas.head(made, f"Errors: {experiment.title}" if experiment.title else "Errors", facts)
    _explain(made, mode_names(experiment, modes) if shown else (), bool(shown))
    return made


def _show_object(places: Sequence[Axes], trace: Trace, begin: float, unit: str) -> None:
    """Draw the row of one true object: its position error, velocity error, and in a third place the modes."""
    times = trace.times - begin
    _show_error(places[0], times, trace, trace.error, trace.sigma)
    _show_error(places[1], times, trace, trace.speed_error, trace.speed_sigma)
    places[0].set_title(trace.name, loc="left", fontsize=11, style="italic", pad=4)
    places[0].set_ylabel(f"position error [{unit}]")
    places[1].set_ylabel(f"velocity error [{unit}/s]")
    if len(places) > 2:
        _show_modes(places[2], times, trace.modes)


def _show_error(axes: Axes, times: Array, trace: Trace, error: Array, sigma: Array) -> None:
    """Draw an error (s,), two standard deviations of it by the filter's covariance, and where there was no track."""
    axes.fill_between(times, 0.0, 2.0 * sigma, color=canvas.FAINT, linewidth=0, zorder=1)
    _shade(axes, times, ~trace.covered)
    for track in np.unique(trace.track[trace.covered]).tolist():
        own = np.where(trace.track == track, error, np.nan)
        axes.plot(times, own, ".-", color=canvas.colour(track), linewidth=1.2, markersize=2.5, zorder=3)
    if np.isfinite(error).any():
        axes.set_ylim(0.0, 1.1 * max(float(np.nanmax(error)), float(np.nanquantile(2.0 * sigma, 0.9))))
    else:
        axes.set_yticks([])
        axes.text(0.5, 0.5, "unknown" if trace.covered.any() else "no track", transform=axes.transAxes, ha="center")


def _shade(axes: Axes, times: Array, where: Mask) -> None:
    """Shade the background where something holds, half way to the neighbouring scans."""
    edges = np.concatenate([times[:1], 0.5 * (times[1:] + times[:-1]), times[-1:]])
    starts = np.flatnonzero(np.diff(np.concatenate([[False], where, [False]]).astype(int)))
    for first, after in starts.reshape(-1, 2).tolist():
        axes.axvspan(edges[first], edges[after], color=_GAP, linewidth=0, zorder=0)


def _show_modes(axes: Axes, times: Array, modes: Array | None) -> None:
    """Draw mode probabilities (s, r) stacked to 1; nothing where they are NaN."""
    top = np.zeros((len(times), 0)) if modes is None else np.cumsum(modes, axis=1)
    for k in range(top.shape[1]):
        bottom = top[:, k - 1] if k else np.zeros(len(times))
        axes.fill_between(times, bottom, top[:, k], color=canvas.MODES[k % len(canvas.MODES)], linewidth=0, zorder=1)
    axes.set_ylim(0.0, 1.0)
    axes.set_ylabel("mode probability")


def _show_normalised(axes: Axes, seen: Normalised, begin: float, name: str, told: str) -> None:
    """Draw normalised squared errors on a logarithmic scale, over the band of chi-square, and `told` as in the summary."""
    if not len(seen.value):
        axes.text(0.5, 0.5, f"no {name}", transform=axes.transAxes, ha="center")
        axes.set(xticks=[], yticks=[])
        return
    for count in np.unique(seen.axes).tolist():
        low, high = band(count)
        axes.axhspan(low, high, color=canvas.FAINT, linewidth=0, zorder=0)
        axes.axhline(count, color=canvas.SOFT, linewidth=1.0, linestyle="--", zorder=1)
    shades = [canvas.colour(track) for track in seen.track.tolist()]
    axes.scatter(seen.times - begin, np.maximum(seen.value, 1e-3), s=7, c=shades, linewidths=0, zorder=3)
    axes.set_yscale("log")
    axes.set_ylabel(name)
    inside = seen.inside() or 0.0
    words = f"{told}; {100 * inside:.3g} % of {len(seen.value):,} in the 95 % band"
    axes.set_title(words, loc="left", fontsize=10, color=canvas.SOFT, pad=4)


def _explain(made: Figure, modes: tuple[str, ...], errors_shown: bool) -> None:
    """Draw one legend for all panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    about = [
        (Line2D([], [], color=canvas.colour(0), marker=".", linewidth=1.2), "length of the error"),
        (Patch(color=canvas.FAINT), "2 standard deviations by the filter's own covariance"),
        (Patch(color=_GAP), "no track covers it"),
    ]
    both = [
        (Patch(color=canvas.FAINT), "95 % band of chi-square"),
        (Line2D([], [], color=canvas.SOFT, linestyle="--"), "expected mean"),
    ]
    if errors_shown:
        both = [(both[0][0], "in NEES, NIS: 95 % band of chi-square"), both[1]]
    areas = [(Patch(color=canvas.MODES[k % len(canvas.MODES)]), f"mode {name}") for k, name in enumerate(modes)]
    entries = [*(about if errors_shown else []), *both, *areas]
    made.legend(
        [handle for handle, _ in entries],
        [text for _, text in entries],
        loc="outside lower center",
        ncols=3,
        frameon=False,
        fontsize=10,
        labelcolor=canvas.INK,
    )
