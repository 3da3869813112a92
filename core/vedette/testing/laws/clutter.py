"""Laws of what a sensor reports of no target, and of the range beyond which it reports none.

Two parameters have a meaning that the laws rely on: `clutter_per_scan`, the expected number of false returns, is the
integral of the density over what the sensor covers; beyond `max_range` no target is detected. Where noise may put a return
beyond what is covered, the density need not be 0.
"""

from __future__ import annotations

import numpy as np

from vedette.roles import Sensor
from vedette.space import Array, Axis
from vedette.testing.comparisons import Closed, demand, frozen_copy, same
from vedette.testing.law import Law
from vedette.testing.laws.sensor_cases import Looks, full
from vedette.testing.states import size

FARTHEST = 1e9
"""Farther than this, in units of an axis' usual size, no density may reach."""
FAINT = 1e-6
"""A density of less than this share of the greatest that is found does not count: the grid would be wasted on its tail."""
CELLS = {1: 4001, 2: 161, 3: 49}


def clutter_takes_any_number_of_returns(sensor: Sensor, drawn: Looks) -> None:
    """The density of a return does not depend on the others, and scans without returns are normal."""
    m, n = len(sensor.measurement), len(sensor.observes)
    for scan in (drawn.z[:0], drawn.z[None, :0]):
        density = np.asarray(sensor.clutter(frozen_copy(scan)))
        demand(
            density.shape in ((), scan.shape[:-1]),
            f"clutter: of returns {scan.shape} must have shape {scan.shape[:-1]} or (), got {density.shape}",
        )
    alone = [np.broadcast_to(sensor.clutter(drawn.z[i : i + 1]), 1)[0] for i in range(3)]
    same("clutter of returns one by one", np.array(alone), np.broadcast_to(sensor.clutter(drawn.z), 3))
    try:
        none = sensor.invert(np.zeros((0, m)))
    except NotImplementedError:
        return
    demand(
        none.mean.shape == (0, n) and none.cov.shape == (0, n, n),
        f"invert: of no returns must have shapes {(0, n)} and {(0, n, n)}, got {none.mean.shape} and {none.cov.shape}",
    )


def false_returns_add_up(sensor: Sensor, drawn: Looks) -> None:
    """If it has `clutter_per_scan` and no `clutter_density` instead: over what it covers, the density integrates to that."""
    wanted = getattr(sensor, "clutter_per_scan", None)
    if not isinstance(wanted, float | int):
        raise Closed("it has no `clutter_per_scan`")
    if getattr(sensor, "clutter_density", 0.0) and wanted == 0:
        raise Closed("its clutter is stated by `clutter_density`")
    axes = sensor.measurement.axes
    if len(axes) not in CELLS:
        raise Closed("it measures too many axes for an integral")
    start = _where_it_is_dense(sensor, drawn)
    if start is None:
        if wanted == 0:
            return
        raise Closed("no false returns lie where the kit looks")
    bounds = [_bounds(sensor, start, i, axis) for i, axis in enumerate(axes)]
    cells = CELLS[len(axes)]
    lines = [low + (high - low) * (np.arange(cells) + 0.5) / cells for low, high in bounds]
    grid = sensor.measurement.canonical(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(axes)))
    volume = np.prod([(high - low) / cells for low, high in bounds])
    found = float(np.sum(np.broadcast_to(sensor.clutter(grid), len(grid)))) * volume
    demand(
        abs(found - wanted) <= 0.03 * wanted,
        f"clutter: integrates to {found:.4g} false returns in a scan, clutter_per_scan says {wanted:g}",
    )


def _where_it_is_dense(sensor: Sensor, drawn: Looks) -> Array | None:
    with np.errstate(all="ignore"):
        seen = [sensor.measure(drawn.x * shrink) for shrink in (1.0, 0.1, 0.01)]
    tried = np.concatenate([*seen, drawn.z, drawn.z * 0.01])
    tried = tried[np.all(np.isfinite(tried), axis=-1)]
    density = np.broadcast_to(sensor.clutter(tried), len(tried))
    return np.array(tried[int(np.argmax(density))]) if np.any(density > 0) else None


def _bounds(sensor: Sensor, start: Array, i: int, axis: Axis) -> tuple[float, float]:
    """Return between which values of axis i the sensor covers: by its parameters `min_*` and `max_*`, or where the density
    is not 0, the other axes being those of `start`. Closed if neither ends.
    """
    if axis.period is not None:
        return -axis.period / 2, axis.period / 2
    word = axis.name.rpartition("_")[2]  # the largest range_rate is max_rate
    most = getattr(sensor, f"max_{axis.name}", None) or getattr(sensor, f"max_{word}", None)
    if most is not None:
        least = getattr(sensor, f"min_{axis.name}", 0.0 if axis.name == "range" else -most)
        return float(least), float(most)
    high = _end(sensor, start, i, axis, 1.0)
    low = getattr(sensor, "min_range", 0.0) if axis.name == "range" else _end(sensor, start, i, axis, -1.0)
    return float(low), high


def _end(sensor: Sensor, start: Array, i: int, axis: Axis, sign: float) -> float:
    """Return where along axis i the density ends, or is too low to count, towards one side."""

    def density(step: float) -> float:
        z = start.copy()
        z[i] += sign * step
        return float(np.broadcast_to(sensor.clutter(sensor.measurement.canonical(z[None])), 1)[0])

    least = FAINT * density(0.0)

    def dense(step: float) -> bool:
        return density(step) > least

    if axis.unit == "rad":  # an angle without a period is an elevation
        far = np.pi / 2 - sign * start[i]
        if dense(far - 1e-9):
            return sign * np.pi / 2
    else:
        far = 1e-3 * size(axis)
        while dense(far):
            far *= 2
            if far > FARTHEST * size(axis):
                raise Closed(f"it does not say over which {axis.name} its false returns spread")
    low, high = 0.0, float(far)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if dense(middle) else (low, middle)
    return float(start[i] + sign * low)


def detects_within_max_range(sensor: Sensor, drawn: Looks) -> None:
    """If it has `max_range`: no target beyond is detected."""
    limit = getattr(sensor, "max_range", None)
    places = [i for i, axis in enumerate(sensor.observes.axes) if axis.name in ("x", "y")]
    if not isinstance(limit, float | int) or len(places) < 2 or not np.isfinite(limit):
        raise Closed("it has no `max_range`")
    station = np.array([float(getattr(sensor, name, 0.0) or 0.0) for name in ("x", "y")])
    far = np.array(drawn.x)
    for row, factor in enumerate((1.05, 3.0, 100.0)):
        far[row, places] = station + factor * limit * np.array([np.cos(drawn.seed), np.sin(drawn.seed)])
    p = full(sensor.detects(far), far, ())
    demand(
        np.all(p == 0), f"detects: must be 0 beyond max_range, {limit:g} m, got {p.tolist()} at 1.05, 3 and 100 times that"
    )
    if "z" not in sensor.observes or "range" not in sensor.measurement:
        return
    for row, factor in enumerate((1.05, 3.0, 100.0)):  # over the sensor: near it in the plane
        far[row, places] = station + 0.1 * limit
        far[row, sensor.observes.names.index("z")] = factor * limit
    beyond = sensor.measure(far)[:, sensor.measurement.names.index("range")] > limit
    p = full(sensor.detects(far), far, ())[beyond]
    demand(
        np.all(p == 0), f"detects: must be 0 above max_range, {limit:g} m, where it measures such a range, got {p.tolist()}"
    )


LAWS = (Law(clutter_takes_any_number_of_returns), Law(false_returns_add_up), Law(detects_within_max_range))
