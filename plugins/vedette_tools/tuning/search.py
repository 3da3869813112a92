"""The highest point of a criterion over the box of all ranges, from several starts."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from vedette.space import Array
from vedette_tools.tuning.evaluator import Asker
from vedette_tools.tuning.field_of_view import even

METHODS = {"nelder-mead": "Nelder-Mead", "powell": "Powell", "l-bfgs-b": "L-BFGS-B"}
SIMPLEX, AGAIN = 0.2, 0.05
"""Sizes of the first simplex, and of that with which the best point is searched around once more, in parts of the ranges."""
COARSE, FINE = (0.01, 0.3), (0.003, 0.03)
"""A search ends when its points agree to this part of the ranges and to this criterion: at first, and once more."""
SCREENED = 6
"""For each further start so many points are looked at, of which the best are taken."""


def highest(asked: Asker, first: Array, starts: int, method: str) -> tuple[Array, list[Array]]:
    """Return the best position (p,), and where each search ended: one begins at `first`, the others at the best points of
    those that are spread evenly.
    """
    p, others = len(first), list[Array]()
    if starts > 1:
        points = list(even(SCREENED * (starts - 1), p))
        order = np.argsort([-height for height in asked.heights(points)], kind="stable")
        others = [points[i] for i in order[: starts - 1]]
    begun = [first, *others]
    if len(begun) == 1:
        ends = [_climbed(asked, first, method, SIMPLEX, COARSE)]
    else:
        with ThreadPoolExecutor(len(begun)) as threads:
            ends = list(threads.map(lambda start: _climbed(asked, start, method, SIMPLEX, COARSE), begun))
    best = ends[int(np.argmax([asked.height(end) for end in ends]))]
    return _climbed(asked, best, "nelder-mead", AGAIN, FINE), ends


def climbed_on(asked: Asker, start: Array) -> Array:
    """Return the end of a close search about a position, or the position itself if that is higher."""
    end = _climbed(asked, start, "nelder-mead", AGAIN, FINE)
    return end if asked.height(end) >= asked.height(start) else start


def _climbed(asked: Asker, start: Array, method: str, size: float, close: tuple[float, float]) -> Array:
    """Return the end of one search."""
    from scipy.optimize import minimize

    p = len(start)
    bounds = [(0.0, 1.0)] * p
    start = np.clip(start, 1e-6, 1.0 - 1e-6)

    def depth(position: Array) -> float:
        height = asked.height(position)
        return -height if np.isfinite(height) else 1e12

    options: dict[str, object]
    if method == "nelder-mead":
        options = {"initial_simplex": _simplex(start, size), "xatol": close[0], "fatol": close[1], "maxfev": 100 * (1 + p)}
    elif method == "powell":
        options = {"xtol": close[0], "ftol": 1e-8, "maxfev": 100 * (1 + p)}
    else:
        options = {"eps": 1e-3, "maxfun": 100 * (1 + p)}
    optimum = minimize(depth, start, method=METHODS[method], bounds=bounds, options=options)  # type: ignore[call-overload]
    return np.clip(np.asarray(optimum.x, dtype=float), 0.0, 1.0)


def _simplex(start: Array, size: float) -> Array:
    """Return a simplex (p+1, p) at a start, whose sides go where there is more room."""
    corners = np.tile(start, (len(start) + 1, 1))
    for i, u in enumerate(start):
        corners[1 + i, i] += size if u <= 0.5 else -size
    return corners


def ended_there(ends: Sequence[Array], best: Array) -> int:
    """Return how many searches ended at the best point, to within a twentieth of the ranges."""
    return sum(bool(np.max(np.abs(end - best)) < 0.05) for end in ends)
