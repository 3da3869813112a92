"""What a sensor sees of the map, found by asking it: arcs of directions, each with its nearest and its farthest place."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vedette import Array, ImagingSensor, Mask, Pose, Sensor

DIRECTIONS = 180
_TRIED = np.geomspace(1.0, 1e6, 121)
_HALVINGS = 20

Sees = Callable[[Array, Array], Mask]


def view(sensor: Sensor, place: tuple[float, float] | None) -> list[dict[str, Any]] | None:
    """Return the arcs in which a sensor detects anything; `place`: where it stands.

    An arc has `rows` of bearing in rad, nearest and farthest in m, and is `closed` if it goes all round. Bearings are from
    the platform's heading, counted from x to y. A farthest place of None is beyond 1,000 km. None where there is no limit
    to tell, or no ground: of images, of a sensor that sees everywhere or nowhere, or that stands in no one place.
    """
    observes = sensor.observes
    if isinstance(sensor, ImagingSensor) or not all(
        name in observes and observes.axes[observes.names.index(name)].unit == "m" for name in "xy"
    ):
        return None
    try:
        stands = sensor if place is not None else sensor.at(Pose(np.zeros(2)))
    except NotImplementedError:
        return None
    centre, spot = np.array(place or (0.0, 0.0)), [observes.names.index(name) for name in "xy"]

    def sees(bearing: Array, distance: Array) -> Mask:
        x = np.zeros((*np.broadcast_shapes(bearing.shape, distance.shape), len(observes)))
        x[..., spot] = centre + np.stack([distance * np.cos(bearing), distance * np.sin(bearing)], axis=-1)
        return np.broadcast_to(stands.detects(x), x.shape[:-1]) > 0

    bearings = np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    near, far = _limits(sees, bearings)
    seen = np.isfinite(near)
    if not seen.any() or (seen.all() and not near.any() and np.isinf(far).all()):
        return None
    if seen.all():
        return [{"closed": True, "rows": _rows(bearings, near, far)}]
    return [{"closed": False, "rows": rows} for rows in _arcs(sees, bearings, near, far)]


def _limits(sees: Sees, bearings: Array) -> tuple[Array, Array]:
    """Return the nearest and the farthest place (d,) seen in each direction, NaN if none; 0 and inf: no limit."""
    seen = sees(bearings[:, None], _TRIED)
    any_, first, last = seen.any(axis=1), seen.argmax(axis=1), len(_TRIED) - 1 - seen[:, ::-1].argmax(axis=1)
    near = _edge(sees, bearings, _TRIED[first], _TRIED[np.maximum(first - 1, 0)])
    far = _edge(sees, bearings, _TRIED[last], _TRIED[np.minimum(last + 1, len(_TRIED) - 1)])
    near = np.where(first == 0, 0.0, near)
    far = np.where(last == len(_TRIED) - 1, np.inf, far)
    return np.where(any_, near, np.nan), np.where(any_, far, np.nan)


def _edge(sees: Sees, bearings: Array, inside: Array, outside: Array) -> Array:
    """Return where what is seen ends in each direction (d,), between a distance that is seen and one that is not."""
    for _ in range(_HALVINGS):
        middle = np.sqrt(inside * outside)
        found = sees(bearings, middle)
        inside, outside = np.where(found, middle, inside), np.where(found, outside, middle)
    return inside


def _arcs(sees: Sees, bearings: Array, near: Array, far: Array) -> list[list[list[float | None]]]:
    """Return the rows of each run of directions in which something is seen, with its ends found exactly."""
    seen = np.isfinite(near)
    begin = int(np.flatnonzero(seen & ~np.roll(seen, 1))[0])
    turned = bearings[begin] + np.arange(DIRECTIONS) * 2 * np.pi / DIRECTIONS
    near, far, seen = np.roll(near, -begin), np.roll(far, -begin), np.roll(seen, -begin)
    arcs = []
    for run in np.split(np.arange(DIRECTIONS), np.flatnonzero(np.diff(seen.astype(int))) + 1):
        if seen[run[0]]:
            at = np.sqrt(np.maximum(near[run], 1.0) * np.minimum(far[run], _TRIED[-1]))
            ends = [_side(sees, turned[run[k]], at[k], side) for k, side in ((0, -1.0), (-1, 1.0))]
            rows = np.concatenate([run[:1], run, run[-1:]])
            arcs.append(_rows(np.array([ends[0], *turned[run], ends[1]]), near[rows], far[rows]))
    return arcs


def _side(sees: Sees, inside: float, distance: float, side: float) -> float:
    """Return the last bearing that is seen at a distance, within one step beyond one that is seen."""
    outside = inside + side * 2 * np.pi / DIRECTIONS
    for _ in range(_HALVINGS):
        middle = 0.5 * (inside + outside)
        inside, outside = (middle, outside) if bool(sees(np.array(middle), np.array(distance))) else (inside, middle)
    return inside


def _rows(bearings: Array, near: Array, far: Array) -> list[list[float | None]]:
    rounded = zip(bearings.round(5).tolist(), near.tolist(), far.tolist(), strict=True)
    return [[b, float(f"{n:.5g}"), None if np.isinf(f) else float(f"{f:.5g}")] for b, n, f in rounded]
