"""How large a target appears: the spread of what stands out, and the size that follows from its change."""

from __future__ import annotations

import numpy as np

from vedette import Array
from vedette_flir.patches import blurred, sample

LEVEL, LEAST = 0.3, 3.0
"""Part of a target's contrast that belongs to it, and the contrast in count below which its size is not looked at."""

CELLS, REACH = 32, 1.6
"""Side of the grid, at most, and its half over the size of the box."""

FAR, NEAR = 0.7, 0.3
"""Parts of the box's sides: farther from its middle is background; nearer is the target's brightest place."""

FOLLOWED, FASTEST = 0.7, 0.3
"""How much of a change of the spread counts as one of the size, in logarithms, as noise adds to small spreads; and the
largest difference of both that counts in full.
"""

FOLLOWS = 0.05
"""Part of the way that a target's growth follows each frame where the box that is reported stays as it was."""

DOUBT = 0.17
"""Standard deviation of the size, as a part of it: 1.96 of them held .95 of the labels of eight clips."""


def spread_of(pixels: Array, centre: Array, box: Array, sign: float) -> float:
    """Return the geometric mean of the standard deviations, in px, of a target's contrast along x and y; NaN if unknown.

    The target is the connected region above .3 of the contrast that holds the brightest place near `centre` (2,). It is
    unknown where that reaches the edge of what is looked at, `REACH` times the `box` (2,), as it is background then.
    """
    from scipy import ndimage

    half = REACH * np.maximum(box, 4.0)
    step = max(1.0, 2.0 * float(half.max()) / CELLS)
    cells = int(np.ceil(2.0 * half.max() / step))
    image = sign * blurred(sample(pixels, centre, step, cells))
    u = step * (np.arange(cells) - 0.5 * (cells - 1))
    across, down = np.abs(u)[None, :], np.abs(u)[:, None]
    level = float(np.median(image[(across > FAR * box[0]) | (down > FAR * box[1])]))
    core = np.where((across < NEAR * box[0] + 1.0) & (down < NEAR * box[1] + 1.0), image, -np.inf)
    top = float(core.max()) - level
    if top < LEAST:
        return float("nan")
    labels, _ = ndimage.label(image > level + LEVEL * top)
    part = labels == labels.ravel()[np.argmax(core)]
    if part[[0, -1]].any() or part[:, [0, -1]].any():
        return float("nan")
    weight = np.where(part, np.minimum((image - level) / top, 1.0), 0.0)
    product = 1.0
    for along in (weight.sum(axis=0), weight.sum(axis=1)):
        share = along / along.sum()
        product *= float(share @ (u - share @ u) ** 2) + step * step / 12.0
    return float(product**0.25)


def grown(growth: float, spread: float, first: float, part: float) -> float:
    """Return the logarithm of a target's growth, moved by `part` towards what its `spread` says beside its `first` one."""
    return growth + part * float(np.clip(FOLLOWED * np.log(spread / first) - growth, -FASTEST, FASTEST))
