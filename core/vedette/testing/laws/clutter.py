"""Laws of what a sensor reports of no target, and of where it reports none.

Three parameters have a meaning that the laws rely on: `clutter_per_scan`, the expected number of false returns, is the
integral of the density over what the sensor covers; beyond `max_range`, and outside of all `sectors`, each from its bearing
`low` to `high`, no target is detected. Where noise may put a return beyond what is covered, the density need not be 0.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from vedette.config.parameters import parameters
from vedette.roles import Sensor
from vedette.space import Array, Axis
from vedette.testing.comparisons import Closed, Lacking, closed_if, demand, frozen_copy, same, stated
from vedette.testing.law import Law
from vedette.testing.laws.noise_units import changed
from vedette.testing.laws.sensor_cases import Looks, full
from vedette.testing.states import size

FARTHEST = 1e9
"""Farther than this, in units of an axis' usual size, no density may reach."""
NEAR, FAR = 100.0, 2000.0
"""Between which ranges, in m, false returns are spread."""
FAINT = 1e-6
"""A density of less than this share of the greatest that is found does not count: the grid would be wasted on its tail."""
CELLS = {1: 4001, 2: 41, 3: 33}
"""Cells an axis of the grid, by the number of axes; a bearing has more: what is covered may end there anywhere."""
BEARINGS = 801


def clutter_takes_any_number_of_returns(sensor: Sensor, drawn: Looks) -> None:
    """The density of a return does not depend on the others, and scans without returns are normal."""
    m, n = len(sensor.measurement), len(sensor.observes)
    for scan in (drawn.z[:0], drawn.z[None, :0]):
        density = np.asarray(sensor.clutter(frozen_copy(scan)))
        otherwise = f"clutter: of returns {scan.shape} must have shape {scan.shape[:-1]} or (), got {density.shape}"
        demand(density.shape in ((), scan.shape[:-1]), otherwise)
    alone = [np.broadcast_to(sensor.clutter(drawn.z[i : i + 1]), 1)[0] for i in range(3)]
    same("clutter of returns one by one", np.array(alone), np.broadcast_to(sensor.clutter(drawn.z), 3))
    try:
        none = sensor.invert(np.zeros((0, m)))
    except NotImplementedError:
        return
    told = f"invert: of no returns must have shapes {(0, n)} and {(0, n, n)}, got {none.mean.shape} and {none.cov.shape}"
    demand(none.mean.shape == (0, n) and none.cov.shape == (0, n, n), told)


def false_returns_add_up(sensor: Sensor, drawn: Looks) -> None:
    """If it has `clutter_per_scan` and no `clutter_density` instead: over what it covers, the density integrates to that."""
    wanted = getattr(sensor, "clutter_per_scan", None)
    if not isinstance(wanted, float | int):
        raise Lacking("clutter_per_scan")
    closed_if(getattr(sensor, "clutter_density", 0.0) and wanted == 0, "its clutter is stated by `clutter_density`")
    axes = sensor.measurement.axes
    closed_if(len(axes) not in CELLS, "it measures too many axes for an integral")
    start = _where_it_is_dense(sensor, drawn)
    if start is None:
        if wanted == 0:
            return
        raise Closed("no false returns lie where the kit looks")
    bounds = [_bounds(sensor, start, i, axis) for i, axis in enumerate(axes)]
    cells = [max(CELLS[len(axes)], BEARINGS if axis.name == "bearing" else 0) for axis in axes]
    lines = [low + (high - low) * (np.arange(n) + 0.5) / n for (low, high), n in zip(bounds, cells, strict=True)]
    grid = sensor.measurement.canonical(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(axes)))
    volume = np.prod([(high - low) / n for (low, high), n in zip(bounds, cells, strict=True)])
    found = float(np.sum(np.where(sensor.covers(grid), np.broadcast_to(sensor.clutter(grid), len(grid)), 0.0))) * volume
    otherwise = f"clutter: integrates to {found:.4g} false returns in a scan, clutter_per_scan says {wanted:g}"
    demand(abs(found - wanted) <= 0.03 * wanted, otherwise)


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
            closed_if(far > FARTHEST * size(axis), f"it does not say over which {axis.name} its false returns spread")
    low, high = 0.0, float(far)
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if dense(middle) else (low, middle)
    return float(start[i] + sign * low)


def false_returns_spread_as_stated(sensor: Sensor, drawn: Looks) -> None:
    """If it has `clutter_density` per area or volume, or `clutter_uniform_over`: false returns spread over that, evenly."""
    known, names = {p.name: p for p in parameters(type(sensor))}, sensor.measurement.names
    placed, power = names == ("x", "y"), 3 if "elevation" in names else 2
    others = {*names} - {"x", "y", "range", "bearing", "elevation"}
    widths = [f"max_{name.rpartition('_')[2]}" for name in others]  # the largest range_rate is max_rate
    if not (placed or "range" in names) or not {*widths} <= {*known}:
        raise Closed("it measures no range or position in the plane, or does not say how far other axes reach")
    limits: dict[str, Any] = {"min_range": NEAR, "max_range": FAR, "sectors": (), **dict.fromkeys(widths, 50.0)}
    evenly = known["clutter_uniform_over"].field.metadata.get("options", ()) if "clutter_uniform_over" in known else ()
    ways = {over: {"clutter_density": 0.0, "clutter_per_scan": 2.0, "clutter_uniform_over": over} for over in evenly}
    if "clutter_density" in known and known["clutter_density"].unit == f"1/m^{power}":
        ways["density"] = {"clutter_density": 1e-6, "clutter_per_scan": 0.0}
    r, angle = np.array([1.5 * NEAR, 0.4 * FAR, 0.95 * FAR]), np.array([0.3, -0.5, 0.9])
    z = np.array(sensor.measure(drawn.x))
    for name, values in (("range", r), ("elevation", angle), ("x", r * np.cos(angle)), ("y", r * np.sin(angle))):
        if name in names:
            z[:, names.index(name)] = values + (float(getattr(sensor, name, 0.0)) if placed else 0.0)
    judged = False
    for over, way in ways.items():
        other = changed(sensor, {name: value for name, value in (limits | way).items() if name in known})
        if other is None or over not in ("density", "area", "range"):
            continue
        judged = True
        degree = 0 if over == "range" else power - 1
        wanted = r**degree * (np.cos(angle) if power == 3 else 1.0) / (r if placed else 1.0) / 100.0 ** len(others)
        if over == "density":
            wanted = 1e-6 * wanted * (1.0 if placed or "bearing" in names else 2 * np.pi)
        else:
            whole = (FAR ** (degree + 1) - NEAR ** (degree + 1)) / (degree + 1) * (2.0 if power == 3 else 1.0)
            wanted = 2.0 * wanted / whole / (2 * np.pi if placed or "bearing" in names else 1.0)
        same(f"clutter, evenly over {over}", np.broadcast_to(other.clutter(frozen_copy(z)), 3), wanted, 1e-6, wanted)
        least = np.min(other.clutter(frozen_copy(-0.1 * z)))  # noise may make a range negative
        demand(least >= 0, f"clutter: must be >= 0 before the sensor too, got {least:.3g}")
    closed_if(not judged, "it says nothing of how its false returns spread")


def detects_within_max_range(sensor: Sensor, drawn: Looks) -> None:
    """If it has `max_range`: no target beyond is detected."""
    limit = stated(sensor, "max_range", "m")
    places = [i for i, axis in enumerate(sensor.observes.axes) if axis.name in ("x", "y")]
    closed_if(len(places) < 2, Lacking("max_range"))
    station = np.array([float(getattr(sensor, name, 0.0) or 0.0) for name in ("x", "y")])
    far = np.array(drawn.x)
    for row, factor in enumerate((1.05, 3.0, 100.0)):
        far[row, places] = station + factor * limit * np.array([np.cos(drawn.seed), np.sin(drawn.seed)])
    p = full(sensor.detects(far), far, ())
    demand(np.all(p == 0), f"detects: must be 0 beyond max_range, {limit:g} m, got {p.tolist()} at 1.05, 3, 100 times that")
    if "z" not in sensor.observes or "range" not in sensor.measurement:
        return
    for row, factor in enumerate((1.05, 3.0, 100.0)):  # over the sensor: near it in the plane
        far[row, places] = station + 0.1 * limit
        far[row, sensor.observes.names.index("z")] = factor * limit
    beyond = sensor.measure(far)[:, sensor.measurement.names.index("range")] > limit
    p = full(sensor.detects(far), far, ())[beyond]
    demand(np.all(p == 0), f"detects: must be 0 where it measures more than max_range, {limit:g} m, got {p.tolist()}")


def detects_within_its_sectors(sensor: Sensor, drawn: Looks) -> None:
    """If it has `sectors`: no target is detected outside of them all, and no false return lies there."""
    sectors = getattr(sensor, "sectors", ())
    places = [i for i, axis in enumerate(sensor.observes.axes) if axis.name in ("x", "y")]
    closed_if(not sectors or len(places) < 2, Lacking("sectors"))
    bearing = np.linspace(-np.pi, np.pi, 64) + drawn.seed
    outside = np.all([np.mod(bearing - one.low, 2 * np.pi) > one.high - one.low + 1e-9 for one in sectors], axis=0)
    bearing = bearing[outside]
    closed_if(not len(bearing), "its `sectors` leave nothing out")
    station, heading = ([float(getattr(sensor, name, 0.0) or 0.0) for name in names] for names in (("x", "y"), ("heading",)))
    distance = float(getattr(sensor, "min_range", 0.0)) + 100.0
    x = np.tile(drawn.x[0], (len(bearing), 1))
    x[:, places] = station + distance * np.stack([np.cos(bearing + heading), np.sin(bearing + heading)], axis=-1)
    p = full(sensor.detects(x), x, ())
    demand(np.all(p == 0), f"detects: must be 0 outside of its sectors, got up to {np.max(p):g}")
    if "bearing" in sensor.measurement or {"x", "y"} <= set(sensor.measurement.names):
        covered = np.any(sensor.covers(sensor.measure(x)))
        demand(not covered, "covers: must be false outside of its sectors")


def sees_nothing_where_it_covers_nothing(sensor: Sensor, drawn: Looks) -> None:
    """Where no false return may lie, no target is detected: both lie in its field of view."""
    x = np.concatenate([drawn.x, 10.0 * drawn.x, 100.0 * drawn.x])
    covered = np.broadcast_to(sensor.covers(sensor.measure(x)), len(x))
    closed_if(covered.all(), "it covers all places that were tried")
    p = full(sensor.detects(x), x, ())[~covered]
    demand(np.all(p == 0), f"detects: must be 0 where `covers` is false, got up to {np.max(p):g}")


LAWS: tuple[Law, ...] = tuple(map(Law, (
    clutter_takes_any_number_of_returns, false_returns_add_up, false_returns_spread_as_stated, detects_within_max_range,
    detects_within_its_sectors, sees_nothing_where_it_covers_nothing,
)))  # fmt: skip
