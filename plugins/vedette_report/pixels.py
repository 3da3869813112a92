"""Figures of one target followed through images, in px."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from vedette import Array, Space, Track, Trajectory

NEAR = 10.0
"""In px; an estimate this near to the truth is on the target."""

LAST = 10
"""Frames at the end; a target is lost if all of them are farther off than NEAR, or than its box."""


def pixel_figures(tracks: Sequence[Track], truth: Sequence[Trajectory]) -> dict[str, Any]:
    """Judge the first track against the true object at the frames of both; nothing if it is not tracked in px.

    There is one object at a time, which may be away in between; nothing is judged where there are two.

    within_10px: part of the frames; centre_error_median_px and centre_error_p90_px; lost: 1 if all of the last 10 frames are
    farther off than 10 px and than the longer side of the true box, else 0; overlap: where tracks and truth have boxes, the
    mean over the frames of the intersection of both over their union.
    """
    if not truth or not tracks or any(path.space != truth[0].space for path in truth):
        return {}
    track, path = tracks[0], truth[0]
    axes = [axis for axis in track.space.axes if axis.name in ("x", "y")]
    if [axis.unit for axis in axes] != ["px", "px"] or any(axis not in path.space.axes for axis in axes):
        return {}
    states = [
        (i, state) for i, time in enumerate(track.times) for target in truth if (state := target.at(float(time))) is not None
    ]
    if not states or len({i for i, _ in states}) < len(states):
        return {}
    places = track.mean[[i for i, _ in states]][:, [track.space.names.index(name) for name in ("x", "y")]]
    true = np.array([state for _, state in states])
    error = np.linalg.norm(places - true[:, [path.space.names.index(name) for name in ("x", "y")]], axis=-1)
    box = [path.space.names.index(name) for name in ("width", "height") if name in path.space]
    allowed = np.maximum(NEAR, np.max(true[:, box], axis=-1, initial=0.0))
    overlap = {}
    if len(box) == 2 and {"width", "height"} <= set(track.space.names):
        rows = track.mean[[i for i, _ in states]]
        overlap["overlap"] = float(np.mean(_overlap(_box(rows, track.space), _box(true, path.space))))
    return {
        "within_10px": float(np.mean(error <= NEAR)),
        "centre_error_median_px": float(np.median(error)),
        "centre_error_p90_px": float(np.percentile(error, 90)),
        "lost": float(np.all((error > allowed)[-LAST:])),
        **overlap,
    }


def _box(states: Array, space: Space) -> Array:
    """Return the corners of boxes (k, 4): left, top, right, bottom."""
    x, y, width, height = (states[:, space.names.index(name)] for name in ("x", "y", "width", "height"))
    return np.stack([x - 0.5 * width, y - 0.5 * height, x + 0.5 * width, y + 0.5 * height], axis=-1)


def _overlap(a: Array, b: Array) -> Array:
    """Return intersection over union (k,) of boxes given by their corners (k, 4)."""
    sides = np.maximum(np.minimum(a[:, 2:], b[:, 2:]) - np.maximum(a[:, :2], b[:, :2]), 0.0)
    both = np.prod(sides, axis=1)
    return both / (np.prod(a[:, 2:] - a[:, :2], axis=1) + np.prod(b[:, 2:] - b[:, :2], axis=1) - both)
