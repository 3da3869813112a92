"""Words beside points of a map, each where it hides no other; one without room is left out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_report.drawing import canvas

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE, _WIDE, _HIGH, _BELOW = 10.0, 0.75, 1.5, 0.4
"""Size of the letters in points; over it a letter's width and height, as bold ones have them, and what is below its line."""

_BESIDE = ((4.0, 5.0), (6.0, -11.0), (-4.0, 5.0), (-6.0, -11.0))
"""Where a word begins, in points from its own; to the left of it, it ends there."""


@frozen
class Label:
    """A word beside a point (2,), in a colour; `looks` are matplotlib's."""

    text: str
    at: Array
    colour: str
    looks: dict[str, str]


def write(axes: Axes, labels: Sequence[Label]) -> int:
    """Write words on a map whose limits are set, the first ones first; return how many had no room.

    The room is reckoned before matplotlib lays the map out, and rather too small.
    """
    from matplotlib.patheffects import withStroke

    (left, right), (bottom, top) = sorted(axes.get_xlim()), sorted(axes.get_ylim())
    size = 72.0 * np.asarray(axes.get_position().size) * np.asarray(axes.figure.bbox.size) / axes.figure.dpi
    scale = float(np.min(size / [max(right - left, 1e-9), max(top - bottom, 1e-9)]))
    up = -1.0 if axes.yaxis_inverted() else 1.0
    letters = canvas.letters(_SIZE)
    taken, lacking = np.zeros((0, 4)), 0
    for label in labels:
        x, y = label.at
        if not (left <= x <= right and bottom <= y <= top):
            continue
        wide, high = _WIDE * letters * len(label.text), _HIGH * letters
        for aside, above in _BESIDE:
            dx, dy = canvas.letters(aside), canvas.letters(above)
            low = np.array([x * scale + dx - (wide if dx < 0 else 0.0), y * scale * up + dy - _BELOW * letters])
            box = np.concatenate([low, low + [wide, high]])
            if not np.any(np.all((box[:2] < taken[:, 2:]) & (taken[:, :2] < box[2:]), axis=-1)):
                break
        else:
            lacking += 1
            continue
        taken = np.concatenate([taken, box[None]])
        axes.annotate(
            label.text,
            (x, y),
            xytext=(dx, dy),
            textcoords="offset points",
            ha="right" if dx < 0 else "left",
            color=label.colour,
            fontsize=letters,
            zorder=7,
            path_effects=[withStroke(linewidth=canvas.stroke(2.5), foreground="white")],
            **label.looks,  # type: ignore[arg-type]  # matplotlib types each of its properties apart
        )
    return lacking
