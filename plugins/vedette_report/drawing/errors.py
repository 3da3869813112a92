"""The picture of errors: how large they are, whether the covariances fit, and the mode probabilities."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vedette import Array, Experiment, Mask, Result
from vedette_report.drawing import canvas
from vedette_report.figures import length_unit
from vedette_report.series.traces import Judged, Normalised, Trace, band, mode_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_MOST = 6
"""Number of true objects with a row of their own; the others still count in the NEES."""

_GAP = "#f6c8c0"


def errors(experiment: Experiment, result: Result, judged: Judged | None = None) -> Figure:
    """Draw errors against time, a row for each true object; then NEES and NIS against their bands.

    In one column of a page there is a panel a row, and of each object its position error alone. `judged` is what the judge
    said of the result; default: it is judged anew.
    """
    judged, truth = Judged.of(experiment, result) if judged is None else judged, result.recording.truth
    shown, followed = judged.traces(truth[:_MOST]), len(truth) if judged.score.scans else 0
    begin = result.scans[0].time if result.scans else 0.0
    modes = next((track.mode_prob.shape[1] for track in result.tracks if track.mode_prob is not None), 0)
    names = mode_names(experiment, modes) if shown and canvas.across(2) > 1 else ()
    spots = _places(len(shown), followed > 0, 3 if names else 2)
    made = canvas.figure(_height(len(shown)), 2, words=1.4 if canvas.across(2) > 1 else 1.8)
    grid = made.add_gridspec(1 + max(row for row, _ in spots), 6)
    places = [made.add_subplot(grid[row, columns]) for row, columns in spots]
    each_has = (len(places) - (2 if followed else 1)) // max(1, len(shown))
    for i, trace in enumerate(shown):
        _show_object(places[i * each_has : (i + 1) * each_has], trace, begin, length_unit(experiment))
    if followed:
        nees = judged.position_nees()
        told = f"mean {np.mean(nees.value) / np.mean(nees.axes):.3g} times the expected one" if len(nees.value) else ""
        _show_normalised(places[-2], nees, begin, "NEES of the position", told)
    told = f"mean {judged.score.nis or 0.0:.3g} times the expected one"
    _show_normalised(places[-1], judged.innovations(), begin, "NIS", told)
    end = (result.scans[-1].time - begin if result.scans else 0.0) or 1.0
    last = max(row for row, _ in spots)
    for panel, (row, _) in zip(places, spots, strict=True):
        canvas.plain(panel)
        panel.set_xlim(-0.01 * end, 1.01 * end)
        panel.locator_params(axis="x", nbins=6)
        if row == last:
            panel.set_xlabel("time since the first scan [s]")
        elif len(panel.get_xticks()):
            panel.tick_params(labelbottom=False)
    facts = "lines and dots have the colours of the tracks in the map; all times are since the first scan"
    if followed > len(shown):
        facts += f"   ·   the first {len(shown)} of {followed:,} true objects; NEES and NIS are of all"
    canvas.head(made, f"Errors: {experiment.title}" if experiment.title else "Errors", facts)
    _explain(made, names, bool(shown))
    return made


def _height(shown: int) -> float:
    """Return the inches of the panels of so many objects in a figure of 12 inches."""
    if canvas.across(2) == 1:
        return 2.1 * (shown + 2)
    return max(6.98, 2.2 * (shown + 1)) if shown else 4.0


def _places(shown: int, followed: bool, beside: int) -> list[tuple[int, slice]]:
    """Return row and columns, of 6, of each panel: those of the objects, then NEES, if anything was followed, and NIS."""
    if canvas.across(2) == 1:
        return [(row, slice(0, 6)) for row in range(shown + (2 if followed else 1))]
    width = 6 // beside
    spots = [(row, slice(k, k + width)) for row in range(shown) for k in range(0, 6, width)]
    return [*spots, *([(shown, slice(0, 3))] if followed else []), (shown, slice(3 if followed else 0, 6))]


def _show_object(places: Sequence[Axes], trace: Trace, begin: float, unit: str) -> None:
    """Draw the row of one true object: its position error, velocity error, and in a third place the modes."""
    times = trace.times - begin
    _show_error(places[0], times, trace, trace.error, trace.sigma)
    places[0].set_title(trace.name, loc="left", fontsize=canvas.letters(11), style="italic", pad=4)
    places[0].set_ylabel(f"position error [{unit}]")
    if len(places) > 1:
        _show_error(places[1], times, trace, trace.speed_error, trace.speed_sigma)
        places[1].set_ylabel(f"velocity error [{unit}/s]")
    if len(places) > 2:
        _show_modes(places[2], times, trace.modes)


def _show_error(axes: Axes, times: Array, trace: Trace, error: Array, sigma: Array) -> None:
    """Draw an error (s,), two standard deviations of it by the filter's covariance, and where there was no track."""
    axes.fill_between(times, 0.0, 2.0 * sigma, color=canvas.FAINT, linewidth=0, zorder=1)
    _shade(axes, times, ~trace.covered)
    for track in np.unique(trace.track[trace.covered]).tolist():
        line = np.where(trace.track == track, error, np.nan)
        axes.plot(
            times,
            line,
            ".-",
            color=canvas.colour(track),
            linewidth=canvas.stroke(1.2),
            markersize=canvas.mark(2.5),
            zorder=3,
        )
    if np.isfinite(error).any():
        axes.locator_params(axis="y", nbins=4)
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
        axes.fill_between(times, bottom, top[:, k], zorder=1, **_area(k))
    axes.set(ylim=(0.0, 1.0), yticks=(0.0, 0.5, 1.0))
    axes.set_ylabel("mode probability")


def _area(k: int) -> dict[str, Any]:
    """Return how the area of a mode looks; where there are more modes than colours, the others are hatched."""
    turn, own = divmod(k, len(canvas.MODES))
    return {"facecolor": canvas.MODES[own], "edgecolor": canvas.SOFT, "hatch": ("", "///", "...")[turn % 3], "linewidth": 0}


def _show_normalised(axes: Axes, seen: Normalised, begin: float, name: str, told: str) -> None:
    """Draw normalised squared errors on a logarithmic scale, over the band of chi-square, and `told` as in the summary."""
    from matplotlib.colors import to_rgba_array

    if not len(seen.value):
        axes.text(0.5, 0.5, f"no {name}", transform=axes.transAxes, ha="center")
        axes.set(xticks=[], yticks=[])
        return
    for count in np.unique(seen.axes).tolist():
        low, high = band(count)
        axes.axhspan(low, high, color=canvas.FAINT, linewidth=0, zorder=0)
        axes.axhline(count, color=canvas.SOFT, linewidth=canvas.stroke(1.0), linestyle="--", zorder=1)
    shades, size = to_rgba_array(canvas.colours(int(np.max(seen.track)) + 1)), max(canvas.mark(2.65), 1.4)
    values = np.maximum(seen.value, 1e-3)
    axes.scatter(seen.times - begin, values, s=size**2, c=shades[seen.track], linewidths=0, zorder=3)
    axes.set_yscale("log")
    axes.minorticks_off()
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_ylabel(canvas.wrapped(name))
    inside = seen.inside() or 0.0
    words = f"{told}; {100 * inside:.3g} % of {len(seen.value):,} in the 95 % band"
    if canvas.on_paper():
        words = words.replace("; ", ";\n")
    axes.set_title(words, loc="left", fontsize=canvas.letters(10), color=canvas.SOFT, pad=4)


def _explain(made: Figure, modes: tuple[str, ...], errors_shown: bool) -> None:
    """Draw one legend for all panels."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    about = [
        (Line2D([], [], color=canvas.colour(0), marker=".", linewidth=canvas.stroke(1.2)), "length of the error"),
        (Patch(color=canvas.FAINT), "2 standard deviations by the filter's own covariance"),
        (Patch(color=_GAP), "no track covers it"),
    ]
    both = [
        (Patch(color=canvas.FAINT), "95 % band of chi-square"),
        (Line2D([], [], color=canvas.SOFT, linestyle="--"), "expected mean"),
    ]
    if errors_shown:
        both = [(both[0][0], "in NEES, NIS: 95 % band of chi-square"), both[1]]
    names = [name if name.startswith("mode ") else f"mode {name}" for name in modes]
    areas = [(Patch(**_area(k)), name) for k, name in enumerate(names)]
    entries = [*(about if errors_shown else []), *both, *areas]
    handles, words = zip(*entries, strict=True)
    made.legend(
        handles, words, loc="outside lower center", ncols=canvas.across(2 if canvas.on_paper() else 3), **canvas.legend()
    )
