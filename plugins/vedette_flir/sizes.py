"""How large a target appears: by the spread of what stands out, and beside its template."""

from __future__ import annotations

import numpy as np

from vedette import Array
from vedette_flir.patches import blurred, median, sample
from vedette_flir.sources.images import one_thread

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

LARGE_FOLLOWS, SURE = 0.2, 0.05
"""The same of a large target, which follows its template; and the standard deviation from which on that says nothing. By
hand, on an airliner that nears before a wood.
"""

REDRAWN = (0.05, 2.0, 1.0)
"""Growth from which on a template is drawn anew: in logarithms, in standard deviations, and in px of the longer side. By
hand, on `ir_clips` and the odd clips made to near and to zoom: with 3 deviations a drone is held in .90 of its frames, with
4 in .48, with 2 in all.
"""

DOUBT = 0.17
"""Standard deviation of the size, as a part of it: 1.96 of them held .95 of the labels of eight clips."""


def spread_of(pixels: Array, centre: Array, box: Array, sign: float) -> float:
    """Return the geometric mean of the standard deviations, in px, of a target's contrast along x and y; NaN if unknown.

    The target is the connected region above .3 of the contrast that holds the brightest place near `centre` (2,). It is
    unknown where that reaches the edge of what is looked at, `REACH` times the `box` (2,), as it is background then.
    """
    half = REACH * np.maximum(box, 4.0)
    step = max(1.0, 2.0 * float(half.max()) / CELLS)
    cells = int(np.ceil(2.0 * half.max() / step))
    image = sign * blurred(sample(pixels, centre, step, cells))
    u = step * (np.arange(cells) - 0.5 * (cells - 1))
    across, down = np.abs(u)[None, :], np.abs(u)[:, None]
    level = median(image[(across > FAR * box[0]) | (down > FAR * box[1])])
    core = np.where((across < NEAR * box[0] + 1.0) & (down < NEAR * box[1] + 1.0), image, -np.inf)
    top = float(core.max()) - level
    if top < LEAST:
        return float("nan")
    with one_thread() as cv2:
        _, labels = cv2.connectedComponents((image > level + LEVEL * top).view(np.uint8), connectivity=4)
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
    return _towards(growth, FOLLOWED * float(np.log(spread / first)), part)


def grown_beside(growth: float, scale: float, larger: float, deviation: float) -> float:
    """Return the logarithm of a large target's growth, as it is `larger` than a template that has grown by `scale`."""
    return growth if deviation > SURE else _towards(growth, scale + larger, LARGE_FOLLOWS)


def _towards(growth: float, other: float, part: float) -> float:
    return growth + part * float(np.clip(other - growth, -FASTEST, FASTEST))


def larger_than(template: Array, shown: Array, mask: Array) -> tuple[float, float]:
    """Return the logarithm of how much larger what is `shown` (p, p) is than a template, and its standard deviation.

    It is that of a least-squares fit along the slopes (Lucas, Kanade, IJCAI 1981), weighted by a `mask`; a shift, a gain and
    a level are fitted with it.
    """
    steps = np.arange(len(template)) - 0.5 * (len(template) - 1)
    down, across = np.gradient(0.5 * (shown + template))
    slopes = np.stack([-across * steps - down * steps[:, None], across, down, template, np.ones_like(template)])
    root = np.sqrt(mask.ravel())
    A, b = (slopes.reshape(5, -1) * root).T, (shown - template).ravel() * root
    inverse = np.linalg.inv(A.T @ A + 1e-9 * np.eye(5))
    found = inverse @ (A.T @ b)
    rest = float(np.sum((b - A @ found) ** 2) / mask.sum())
    return float(found[0]), float(np.sqrt(rest * inverse[0, 0]))


def redrawn(size: float, ahead: float, larger: float, deviation: float) -> float:
    """Return by which factor a template of a target of so many px is drawn larger.

    Its growth is `ahead` of the template's, and what a frame shows is `larger`, in logarithms. Both must say so: the spread
    alone takes what a target leaves behind for growth.
    """
    part, deviations, px = REDRAWN
    less = min(abs(ahead), abs(larger)) if ahead * larger > 0 else 0.0
    return float(np.exp(np.copysign(less, larger))) if less > max(part, deviations * deviation, px / size) else 1.0
