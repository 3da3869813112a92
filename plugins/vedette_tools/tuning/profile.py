"""The criterion along each parameter, and a top that nothing evaluated exceeds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from attrs import frozen

from vedette.space import Array
from vedette_tools.tuning.errors import Curvature, curvature
from vedette_tools.tuning.evaluation import settled as known_at
from vedette_tools.tuning.evaluator import Asker
from vedette_tools.tuning.search import FINE, climbed_on, highest

ROUNDS = 3
"""So often a top is sought anew with what the config does not state as the top before found it."""
REACH, CURVE = 2.5, 9
"""A parameter's curve reaches so many standard errors to both sides, in so many points."""


@frozen(eq=False)
class Curve:
    """How the criterion falls from its top along one parameter, the others following as they are tied to it.

    `parabola`: how it would by the standard error, None if that is not known.
    """

    values: Array
    heights: Array
    parabola: Array | None


@frozen(eq=False)
class Settled:
    """The top with its errors, the curve of each parameter through it, and where each search ended.

    `onward`: how often the search went on from a point, met about a top, that was higher.
    """

    known: Curvature
    curves: Sequence[Curve]
    ends: Sequence[Array]
    onward: int


def settled(asked: Asker, first: Array, starts: int, method: str) -> Settled:
    """Return the top that is higher, to the search's tolerance, than every point looked at.

    Errors and curves look farther than a search: where they meet a higher point, the search goes on from it. Each time the
    top grows by more than the tolerance, so this ends.
    """
    top, ends = highest(asked, first, starts, method)
    for _ in range(ROUNDS if asked.by == "likelihood" else 0):
        data = known_at(asked.data, asked.free, asked.values(top))
        if data.unstated.like(asked.data.unstated):
            break
        asked.go_on(data)
        top = climbed_on(asked, top)
    onward = 0
    while True:
        known = curvature(asked, top)
        curves = tuple(_curve(asked, known, i) for i in range(len(known.position)))
        best = asked.best
        if best is None or asked.height(best) <= asked.height(known.position) + FINE[1]:
            return Settled(known, curves, ends, onward)
        top, onward = climbed_on(asked, best), onward + 1


def _curve(asked: Asker, known: Curvature, i: int) -> Curve:
    """Return the criterion along one parameter; the others move with it as their errors go together."""
    error, direction = float(known.error[i]), np.zeros(len(known.position))
    direction[i] = 1.0
    if np.isfinite(error) and error > 0:
        direction = np.where(np.isfinite(known.cov[i]), known.cov[i] / error**2, 0.0)
    reach = REACH * error if np.isfinite(error) and error > 0 else 1.0
    along = np.linspace(max(known.position[i] - reach, 0.0), min(known.position[i] + reach, 1.0), CURVE)
    points = [np.clip(known.position + (u - known.position[i]) * direction, 0.0, 1.0) for u in along]
    heights = np.array(asked.heights(points)) - asked.height(known.position)
    parabola = -0.5 * ((along - known.position[i]) / error) ** 2 if np.isfinite(error) and error > 0 else None
    return Curve(np.array([asked.values(point)[i] for point in points]), heights, parabola)
