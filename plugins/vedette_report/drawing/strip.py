"""The pictures of a run through images: cut-outs around the track, from left to right and from top to bottom."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vedette.experiment import Experiment, Result
from vedette_report.drawing import canvas

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ACROSS, DOWN = 6, 3


def strip(experiment: Experiment, result: Result) -> Figure:
    """Draw eighteen frames, evenly over the run: the first track (cross), and the true box where it is known."""
    from matplotlib.patches import Rectangle

    made = canvas.figure(6.38)
    boxes = [truth for truth in result.recording.truth if {"width", "height"} <= {*truth.space.names}]
    of = f"first of {len(result.tracks)} tracks" if len(result.tracks) > 1 else "track"
    canvas.head(
        made,
        f"Cut-outs: {experiment.title}" if experiment.title else "Cut-outs",
        f"cut-outs around the {of} (cross); {'the true box dashed; ' if boxes else ''}times in s",
    )
    track = result.tracks[0] if result.tracks else None
    frames = result.framed
    chosen: list[int] = (
        np.unique(np.linspace(0, len(frames) - 1, ACROSS * DOWN).astype(int)).tolist() if frames and track else []
    )
    for place, k in enumerate(chosen):
        assert track is not None
        scan = frames[k]
        assert scan.frame is not None
        axes = made.add_subplot(DOWN, ACROSS, place + 1)
        pixels, corner = scan.frame.pixels, np.zeros(2) if scan.frame.corner is None else scan.frame.corner
        near = int(np.argmin(np.abs(track.times - scan.time)))
        own = dict(zip(track.space.names, track.mean[near], strict=True))
        x, y = own["x"], own["y"]
        low, high = corner - 0.5, corner + np.array(pixels.shape[::-1]) - 0.5
        axes.imshow(pixels, cmap="gray", extent=(low[0], high[0], high[1], low[1]), interpolation="nearest")
        axes.plot([x], [y], "+", color=canvas.colour(1), markersize=canvas.mark(12))
        box = max(24.0, 1.5 * own.get("width", 0.0), 1.5 * own.get("height", 0.0))
        for truth in boxes:
            if (state := truth.at(scan.time)) is not None:
                at = dict(zip(truth.space.names, state, strict=True))
                box = max(box, 1.5 * at["width"], 1.5 * at["height"])
                left, top = at["x"] - 0.5 * at["width"], at["y"] - 0.5 * at["height"]
                axes.add_patch(
                    Rectangle((left, top), at["width"], at["height"], fill=False, linestyle="--", edgecolor=canvas.colour(4))
                )
        axes.set_xlim(x - box, x + box)
        axes.set_ylim(y + box, y - box)
        axes.set_xticks([])
        axes.set_yticks([])
        doubt = "" if track.existence[near] >= 0.5 else ", lost" if track.confirmed[near] else ", new"
        axes.set_title(f"{scan.time:.2f}{doubt}", fontsize=canvas.letters(8), color=canvas.SOFT)
    return made
