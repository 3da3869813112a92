"""How the picture of a frame lies in a later one: shifted, rolled and zoomed."""

from __future__ import annotations

import numpy as np

from vedette import Array
from vedette_flir.estimators.surroundings import ALIKE
from vedette_flir.patches import peak
from vedette_flir.sources.images import one_thread

TURNED = 0.001
"""Likeness that a turn by two cells costs, so that of places alike, as of a row of posts, the nearest is taken. By hand."""

LIKELY = 0.1
"""Standard deviation of a roll, in rad, and of the logarithm of a zoom: a plain scene tells neither. By hand."""

LEVELS, SMALLEST = 3, 8
"""Halvings of the frames, of a side of at least so many cells."""

ROUNDS, STILL, COMMON = 10, 0.02, 0.25
"""Rounds of a fit, until one moves no edge by so many cells; part of a frame that the other must show."""


def laid_over(then: Array, now: Array) -> Array:
    """Return the matrix (3, 3) that brings cells of one frame (h, w) to those of a later one (h, w).

    A shift by up to a quarter of each side is sought, then shift, roll, zoom and gain are fitted by least squares, from
    coarse to fine and in the finest alone, as either may go astray (Lucas, Kanade, IJCAI 1981; Baker, Matthews, Lucas-Kanade
    20 Years On, IJCV 56, 2004). Frames of less than 8 cells a side count as those of a camera that stands.
    """
    pairs = [(_without_outliers(then), _without_outliers(now))]
    with one_thread() as cv2:
        while len(pairs) <= LEVELS and min(pairs[-1][0].shape) >= SMALLEST:
            pairs.append(tuple(cv2.pyrDown(image) for image in pairs[-1]))
    if len(pairs) == 1:
        return np.eye(3)
    shifted, found = _shifted(*pairs[1]), []
    for coarsest in {len(pairs) - 1, 1}:
        turn, rest = shifted, np.inf
        for level in range(coarsest, 0, -1):
            halved = np.diag([0.5**level, 0.5**level, 1.0])
            turn, rest = _fitted(*pairs[level], halved @ turn @ np.linalg.inv(halved))
            turn = np.linalg.solve(halved, turn @ halved)
        found.append((rest, turn))
    return min(found, key=lambda each: each[0])[1]


def _shifted(then: Array, now: Array) -> Array:
    """Return the best shift of halved frames as a matrix (3, 3), in cells of the whole ones."""
    down, right = (side // 4 for side in then.shape)
    with one_thread() as cv2:
        template = then[down : then.shape[0] - down, right : then.shape[1] - right]
        likeness = cv2.matchTemplate(now, template, cv2.TM_CCOEFF_NORMED)
    y, x = np.ogrid[: likeness.shape[0], : likeness.shape[1]]
    row, column, fine = peak(likeness - TURNED * np.hypot(x - right, y - down))
    turn = np.eye(3)
    turn[:2, 2] = 2.0 * (np.array([column - right, row - down]) + fine)
    return turn


def _fitted(then: Array, now: Array, turn: Array) -> tuple[Array, float]:
    """Return the matrix (3, 3) from one frame to another that is likeliest, near one that is known, and the variance, in
    count^2, that it left in the round before the last.
    """
    (height, width), rest = then.shape, np.inf
    y, x = np.arange(height)[:, None] - 0.5 * (height - 1), np.arange(width) - 0.5 * (width - 1)
    middle = np.array([[1.0, 0.0, -x[0]], [0.0, 1.0, -y[0, 0]], [0.0, 0.0, 1.0]])
    along_y, along_x = np.gradient(then.astype(float))
    slopes = np.stack([along_x, along_y, x * along_y - y * along_x, x * along_x + y * along_y, then]).reshape(5, -1)
    for _ in range(ROUNDS):
        with one_thread() as cv2:
            flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
            change = (cv2.warpAffine(now, turn[:2], (width, height), flags=flags, borderValue=np.nan) - then).ravel()
        seen = np.isfinite(change)
        if seen.sum() < COMMON * len(seen):
            break
        G, r = slopes[:, seen], change[seen].astype(float)
        G, r = G - G.mean(axis=1, keepdims=True), r - r.mean()
        rest = float(r @ r) / len(r)
        stiff = ALIKE * rest / LIKELY**2 * np.array([0.0, 0.0, 1.0, 1.0, 0.0])
        a, b = turn[:2, 0]
        turned = np.array([0.0, 0.0, np.arctan2(b, a), np.log(np.hypot(a, b)), 0.0])
        off = np.linalg.solve(G @ G.T + np.diag(stiff + 1e-9), G @ r + stiff * turned)
        a, b = np.exp(off[3]) * np.cos(off[2]), np.exp(off[3]) * np.sin(off[2])
        step = np.array([[a, -b, off[0]], [b, a, off[1]], [0.0, 0.0, 1.0]])
        turn = turn @ middle @ np.linalg.inv(step) @ np.linalg.inv(middle)
        if np.max(np.abs(off[:2])) + np.max(np.abs(off[2:4])) * 0.5 * width < STILL:
            break
    return turn, rest


def _without_outliers(image: Array) -> Array:
    """Return an image with what stands out clipped: a target, or what is like one, would be laid upon another.

    Beyond 1.5 times the range of the middle half (Tukey, Exploratory Data Analysis, 1977).
    """
    low, high = np.quantile(image, (0.25, 0.75))
    fence = 1.5 * (high - low)
    return np.clip(image, np.float32(low - fence), np.float32(high + fence))
