"""Undetected targets by place: cells in which as many appear, each thinned by what looks there, mixed with its neighbours.

A cell's number (c, n, .., n) is the expected number in all of what the c-th row stands for if all were like this cell.
Places in a row are counted from 0 to 1 along each of d axes, as shares of the targets that appear.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from vedette import Array

LEAST, MOST = 64, 2**14
"""How many cells lie in a view, by which a disc is as large to 3 %, and beside it, unless that is 1 % at most; and how many
are not cut finer, or in which a view is sought: of 2^12, half of the views of 1/8000 were not found."""


def middles(n: int, d: int) -> Array:
    """Return the middle (n^d, d) of each of n cells along each axis."""
    return np.stack(np.meshgrid(*[(np.arange(n) + 0.5) / n] * d, indexing="ij"), axis=-1).reshape(n**d, d)


def looked(number: Array, detects: Callable[[Array], Array], p_gate: float) -> Array:
    """Return the numbers after a look, in cells as small as its view needs.

    detects: the probability, (p, d) -> (c, p) or (), that it detects what is at places.
    """
    rows, d = len(number), number.ndim - 1
    n = max(number.shape[1], 2 ** math.ceil(math.log2(LEAST) / d))
    while (p_detect := detects(middles(n, d))).ndim:
        seen = np.count_nonzero(p_detect > 0.5 * np.max(p_detect), axis=-1)
        few = (seen < LEAST) & (seen > 0) | (seen < 0.99 * n**d) & (n**d - seen < LEAST)
        if rows * (2 * n) ** d > MOST or (seen.any() and not few.any()):
            break
        n *= 2
    if p_detect.ndim and np.any(p_detect != p_detect[..., :1]):  # else it sees all alike, or none
        for axis in range(1, d + 1):
            number = number.repeat(n // number.shape[axis], axis)
        p_detect = p_detect.reshape(-1, *number.shape[1:])
    elif p_detect.ndim:
        p_detect = p_detect[:, :1].reshape(-1, *[1] * d)
    return np.asarray(number * (1.0 - p_gate * p_detect))


def counted(number: Array, places: Array, detects: Callable[[Array], Array]) -> Array:
    """Return the numbers (c, k) at places (c, k, d): of the cells around each, the nearest of those that a sensor sees best.

    detects: (c, k, e, d) -> (c, k, e) or (). What lies just within a view is not counted as what lies beyond.
    """
    n, d = number.shape[1], number.ndim - 1
    if n == 1:
        return np.broadcast_to(number.reshape(-1, 1), places.shape[:-1])
    at = places[..., None, :] * n - 0.5
    around = np.floor(at) + np.indices((2,) * d).reshape(d, -1).T
    cell = np.clip(around, 0, n - 1)
    seen = np.broadcast_to(detects((cell + 0.5) / n), cell.shape[:-1])
    best = np.argmax(np.prod(1.0 - np.abs(at - around), axis=-1) * (1e-9 + seen), axis=-1)
    own = np.take_along_axis(cell, best[..., None, None], axis=-2)[..., 0, :].astype(np.intp)
    return number[(np.arange(len(number))[:, None], *np.moveaxis(own, -1, 0))]


def moved(number: Array, axis: int, distance: Array, faces: Callable[[Array], Array]) -> Array:
    """Return the numbers after targets have moved by N(0, distance^2) along an axis, distance (c,).

    Through a face pass distance / sqrt(2 pi) times the density there, which `faces` says of its place (n-1,), both ways.
    """
    n = number.shape[1 + axis]
    if n == 1 or not np.any(distance > 0):
        return number
    from scipy.linalg import eigh_tridiagonal

    through = n * faces(np.arange(1, n) / n)
    rate, mode = eigh_tridiagonal(np.append(through, 0.0) + np.append(0.0, through), -through)
    kept = np.exp(-np.outer(distance / math.sqrt(2.0 * math.pi), rate))
    along = np.moveaxis(number, 1 + axis, 1)
    after = ((mode * kept[:, None]) @ mode.T @ along.reshape(*along.shape[:2], -1)).reshape(along.shape)
    return np.maximum(np.moveaxis(after, 1, 1 + axis), 0.0)  # 0 but for rounding
