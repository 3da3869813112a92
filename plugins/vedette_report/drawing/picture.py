"""The picture of a run: truth, returns, tracks with their covariances, platforms."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from vedette import Array, Experiment, Frame, InputError, Mask, Result, Track, Trajectory
from vedette_report.drawing import canvas
from vedette_report.drawing.labels import Label, write
from vedette_report.figures import count
from vedette_report.map.plane import Plane, returns, stands

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ELLIPSE = -2.0 * np.log(0.05)
"""Squared Mahalanobis distance that holds 95 % of a Gaussian in the plane."""

_ELLIPSES = 14
"""Number of ellipses of the longest track; the others get them as often."""

_NAMED = 60
"""More names than this hide the picture: only the longest tracks and true paths may get theirs."""

_RINGED = 1_000
"""More tracks' ellipses than this cover everything: only the longest tracks get theirs."""

_SHAPE = 1.44
"""Width of the map over its height, as title and legend leave it."""

_REACH = 0.1
"""How far returns stretch the map on each side, as a part of the paths' size."""

_LISTED = 4
"""So many sensors are counted, and fewer named."""

_MARKS = (("o", 2.6), ("+", 4.5), ("x", 3.5), ("^", 3.2), ("s", 2.4))


def picture(experiment: Experiment, result: Result) -> Figure:
    """Draw a run as a map, one scale for both axes; over its first frame, y down, where it is in an image."""
    made = canvas.figure(7.78, words=0.6)
    axes = made.add_subplot()
    spots, outside, lacking = show(axes, experiment, result)
    facts = _facts(result, spots, outside, lacking)
    canvas.head(made, f"Tracks: {experiment.title}" if experiment.title else "Tracks", facts)
    if axes.get_legend_handles_labels()[0]:
        made.legend(loc="outside lower center", ncols=max(2, canvas.across(3)), **canvas.legend())
    return made


def plot(result: Result, axes: Axes | None = None) -> Axes:
    """Draw the map of a run on given axes, or on new ones; return them. InputError if these are no axes."""
    from matplotlib import axes as of_matplotlib

    if axes is None:
        from matplotlib import pyplot as plt

        axes = plt.subplots(figsize=(9.0, 7.0), layout="constrained")[1]
    elif not isinstance(axes, of_matplotlib.Axes):
        raise InputError(f"axes: must be axes of matplotlib, got {axes!r}; result.plot().figure.savefig(...) writes a file")
    show(axes, result.made_by, result)
    # below the axes: on the map it would hide returns and tracks, which may be anywhere
    axes.legend(fontsize=canvas.letters(8), frameon=False, ncols=3, loc="upper center", bbox_to_anchor=(0.5, -0.12))
    return axes


def show(axes: Axes, experiment: Experiment, result: Result) -> tuple[dict[str, Array | None], int, int]:
    """Draw the map on axes; return the returns' positions by sensor, how many lie outside, and how many names lack room."""
    tracker = experiment.tracker
    plane = Plane.of(tracker.state, result.recording)
    canvas.plain(axes)
    spots = returns(result.scans, tracker.sensors, plane)
    truth = [path for path in result.recording.truth if plane.within(path.space)]
    platforms = stands(result.scans, tracker.sensors, plane)
    image = _first_frame(result, plane)
    _show_returns(axes, spots)
    numbers = _show_tracks(axes, result.tracks, plane, in_image=image is not None)
    names = _show_truth(axes, truth, plane)
    _show_platforms(axes, platforms)
    paths = [plane.points(path.space, path.states) for path in truth] + platforms
    paths += [plane.points(track.space, track.mean[_seen(track)]) for track in result.tracks]
    outside = _frame(axes, paths, [spot for spot in spots.values() if spot is not None])
    if image is not None:
        _show_frame(axes, image)
    elif all(axis.unit == "px" for axis in plane.axes):
        axes.invert_yaxis()  # as in images
    lacking = write(axes, [*names, *numbers])
    axes.set(xlabel=plane.labels[0], ylabel=plane.labels[1])
    return {} if image else spots, outside, lacking


def _facts(result: Result, spots: dict[str, Array | None], outside: int, lacking: int) -> str:
    span = result.scans[-1].time - result.scans[0].time if result.scans else 0.0
    facts = [
        f"{count(len(result.scans), 'scan')} over {span:,.{0 if span >= 100 else 1}f} s",
        count(len(result.tracks), "confirmed track"),
    ]
    if result.recording.truth:
        facts.append(count(len(result.recording.truth), "true object"))
    if lacking:
        facts.append("names where there is room")
    elif max(len(result.tracks), len(result.recording.truth)) > _NAMED:
        facts.append(f"names of the {_NAMED} longest")
    if len(result.tracks) > _RINGED:
        facts.append(f"ellipses of the {_RINGED:,} longest")
    if outside:
        facts.append(f"{count(outside, 'return')} outside the picture")
    if lost := [name for name, spot in spots.items() if spot is None]:
        who = ", ".join(lost) if len(lost) < _LISTED else count(len(lost), "sensor")
        facts.append(f"{who}: one return gives no position, not drawn")
    return "   ·   ".join(facts)


def _first_frame(result: Result, plane: Plane) -> Frame | None:
    """Return the first frame of a run, if it is one image and the map shows its pixels."""
    if not len(result.framed) or [(axis.name, axis.unit) for axis in plane.axes] != [("x", "px"), ("y", "px")]:
        return None
    frame = result.framed[0].frame
    return frame if frame is not None and frame.pixels.ndim == 2 else None


def _show_frame(axes: Axes, frame: Frame) -> None:
    """Put an image behind the map, pale, so that dark lines are seen on it; the map has its limits and orientation."""
    pixels = np.asarray(frame.pixels, dtype=float)
    known = pixels[np.isfinite(pixels)]
    low, high = np.percentile(known, [0.5, 99.5]) if known.size else (0.0, 1.0)
    corner = np.zeros(2) if frame.corner is None else frame.corner
    left, top, right, bottom = (float(side) - 0.5 for side in (*corner, *(corner + pixels.shape[::-1])))
    dark, bright = low - 1.5 * (high - low), max(high, low + 1e-6)
    extent = (left, right, bottom, top)
    axes.imshow(pixels, cmap="gray", vmin=dark, vmax=bright, extent=extent, interpolation="nearest", zorder=0)
    axes.set(xlim=(left, right), ylim=(bottom, top))
    axes.grid(visible=False)


def _show_returns(axes: Axes, spots: dict[str, Array | None]) -> None:
    for i, (name, spot) in enumerate(spots.items()):
        if spot is not None and len(spot):
            mark, size = _MARKS[i % len(_MARKS)]
            alpha = float(np.clip(25.0 / np.sqrt(len(spot)), 0.2, 0.7))
            x, y = spot.T
            axes.plot(
                x,
                y,
                mark,
                color="#808080",
                markersize=canvas.mark(size),
                markeredgewidth=canvas.stroke(0.6),
                alpha=alpha,
                zorder=1,
            )
            axes.plot(
                [], [], mark, color="#808080", markersize=canvas.mark(size + 1.5), label=f"returns of {name} ({len(spot):,})"
            )


def _show_truth(axes: Axes, truth: Sequence[Trajectory], plane: Plane) -> list[Label]:
    """Draw paths with a mark at the end; return the names of the longest."""
    if not truth:
        return []
    paths = [plane.points(path.space, path.states) for path in truth]
    canvas.lines(axes, paths, [canvas.INK] * len(paths), linewidth=canvas.stroke(0.9), zorder=4)
    axes.plot([], [], color=canvas.INK, linewidth=canvas.stroke(0.9), label="truth, its name at the end")
    ends = np.concatenate([path[-1:] for path in paths])
    axes.plot(*ends.T, "s", color=canvas.INK, markersize=canvas.mark(3.5), zorder=4)
    named = _longest([path.times for path in truth], _NAMED)
    return [Label(truth[i].name, paths[i][-1], canvas.INK, {"style": "italic"}) for i in named]


def _show_tracks(axes: Axes, tracks: Sequence[Track], plane: Plane, *, in_image: bool) -> list[Label]:
    """Draw paths and covariances; in an image what exists with probability under one half is lost, and drawn as such.

    Return the numbers of the longest tracks. More of them get their ellipses: so the cost grows with the tracks, not faster.
    """
    if not tracks:
        return []
    times = [track.times for track in tracks]
    shades = canvas.colours(len(tracks))
    paths = [plane.points(track.space, track.mean) for track in tracks]
    held = [track.confirmed & (track.existence >= 0.5) if in_image else track.confirmed for track in tracks]
    sure = [np.where(some[:, None], path, np.nan) for some, path in zip(held, paths, strict=True)]
    dotted: dict[str, Any] = {"linewidth": canvas.stroke(0.8), "linestyle": (0, (1, 2))}
    canvas.lines(axes, paths, shades, zorder=2, **dotted)
    canvas.lines(axes, sure, shades, linewidth=canvas.stroke(3.0), alpha=0.85, zorder=3, solid_capstyle="round")
    every = max(time[-1] - time[0] for time in times) / _ELLIPSES
    rings: list[Array] = []
    ringed = _longest(times, _RINGED)
    for i in ringed:
        some = _spread(times[i], held[i] & _seen(tracks[i]), every)
        cov = plane.covariances(tracks[i].space, tracks[i].cov[some])
        rings.append(_in_one(ellipses(paths[i][some], cov)))
    canvas.lines(axes, rings, [shades[i] for i in ringed], linewidth=canvas.stroke(0.9), alpha=0.9, zorder=3)
    first = canvas.colour(0)
    axes.plot([], [], color=first, linewidth=canvas.stroke(3.0), label="track, its number at the start")
    axes.plot([], [], color=first, label="lost, or new" if in_image else "not confirmed", **dotted)
    axes.plot([], [], "o", color=first, fillstyle="none", markersize=canvas.mark(9), label="95 % of its covariance")
    starts = {i: paths[i][int(np.argmax(tracks[i].confirmed))] for i in _longest(times, _NAMED)}
    return [Label(str(tracks[i].id), at, shades[i], {"weight": "bold"}) for i, at in starts.items()]


def _longest(times: Sequence[Array], most: int) -> list[int]:
    """Return which paths have the most times, at most so many, in their order."""
    return sorted(sorted(range(len(times)), key=lambda i: -len(times[i]))[:most])


def _in_one(rings: Array) -> Array:
    """Return rings (q, k, 2) as one path with breaks."""
    broken = np.concatenate([rings, np.full((len(rings), 1, 2), np.nan)], axis=1)
    return broken.reshape(-1, 2)[:-1]


def _seen(track: Track) -> Mask:
    """Return where a confirmed track had a return (s,), or all if it had none: a lost track must not cover the map."""
    seen: Mask = track.confirmed & (track.hit > 0.5)
    return seen if seen.any() else track.confirmed


def _spread(times: Array, held: Mask, every: float) -> list[int]:
    """Return scans at least `every` s apart at which a track was held."""
    chosen: list[int] = []
    for i in np.flatnonzero(held):
        if not chosen or times[i] - times[chosen[-1]] >= max(every, 1e-9):
            chosen.append(int(i))
    return chosen


def ellipses(mean: Array, cov: Array) -> Array:
    """Return the lines that hold 95 % of Gaussians in the plane: (t, 2), (t, 2, 2) -> (t, 48, 2)."""
    angle = np.linspace(0.0, 2.0 * np.pi, 48)
    circle = np.sqrt(ELLIPSE) * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    size, axis = np.linalg.eigh(cov)
    root = axis * np.sqrt(np.maximum(size, 0.0))[..., None, :]
    return mean[..., None, :] + circle @ np.swapaxes(root, -1, -2)


def _show_platforms(axes: Axes, platforms: Sequence[Array]) -> None:
    for i, path in enumerate(platforms):
        moves = len(path) > 1 and bool(np.ptp(path, axis=0).max() > 0)
        label = "platform of the sensors" if i == 0 else None
        x, y = path.T
        if moves:
            axes.plot(x, y, color=canvas.INK, linewidth=canvas.stroke(1.2), linestyle=(0, (6, 3)), zorder=4)
        axes.plot(
            x[-1:],
            y[-1:],
            "^",
            label=label,
            color="#ffd23f",
            markeredgecolor=canvas.INK,
            markersize=canvas.mark(11),
            zorder=6,
        )


def _frame(axes: Axes, paths: Sequence[Array], spots: Sequence[Array]) -> int:
    """Set the limits around all paths, and returns near them; return how many returns lie outside.

    Returns may stretch the frame by a fraction of the paths' size only: distant clutter must not shrink everything else.
    """
    axes.set_aspect("equal", adjustable="box")
    known = np.concatenate([np.zeros((0, 2)), *paths])
    seen = np.concatenate([np.zeros((0, 2)), *spots])
    if not len(known):
        known = np.median(seen, axis=0, keepdims=True) if len(seen) else np.zeros((1, 2))
    low, high = known.min(axis=0), known.max(axis=0)
    size = max(float(np.max(high - low)), 1.0)
    if len(seen):
        edge, reach = (seen.min(axis=0), seen.max(axis=0)), _REACH * size
        low, high = np.minimum(low, np.maximum(edge[0], low - reach)), np.maximum(high, np.minimum(edge[1], high + reach))
    span = np.maximum(high - low, 1e-9 if np.any(high > low) else 1.0)
    span = 1.06 * np.maximum(span, [_SHAPE * span[1], span[0] / _SHAPE])
    low, high = 0.5 * (low + high - span), 0.5 * (low + high + span)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    return int(np.count_nonzero(np.any((seen < low) | (seen > high), axis=-1)))
