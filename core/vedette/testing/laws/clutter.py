"""Laws of what a sensor reports of no target, and of where it reports none.

Three parameters have a meaning that the laws rely on: `clutter_per_scan`, the expected number of false returns, is the
integral of the density over what the sensor covers; beyond `max_range`, and outside of all `sectors`, each from its bearing
`low` to `high`, no target is detected. Where noise may put a return beyond what is covered, the density need not be 0.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from vedette.config.parameters import parameters
from vedette.roles import Sensor
from vedette.space import Array, Axis
from vedette.testing.comparisons import Broken, Closed, Lacking, Unlike, closed_if, demand, frozen_copy, same, stated
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
    """The density of a return is finite, >= 0 and does not depend on the others; scans without returns are normal."""
    m, n = len(sensor.measurement), len(sensor.observes)
    for scan in (drawn.z[:0], drawn.z[None, :0]):
        density = np.asarray(sensor.clutter(frozen_copy(scan)))
        otherwise = f"clutter: of returns {scan.shape} must have shape {scan.shape[:-1]} or (), got {density.shape}"
        demand(density.shape in ((), scan.shape[:-1]), otherwise)
    alone = np.array([np.broadcast_to(sensor.clutter(drawn.z[i : i + 1]), 1)[0] for i in range(3)])
    demand(np.all((alone >= 0) & np.isfinite(alone)), f"clutter: must be finite and >= 0, got {alone.tolist()}")
    twice = sensor.clutter(frozen_copy(np.stack([drawn.z, drawn.z[::-1]])))
    same("clutter of two runs", np.broadcast_to(twice, (2, 3)), np.stack([alone, alone[::-1]]))
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
    least = FAINT * float(_density(sensor, start[None])[0])

    def inside(z: Array) -> bool:
        one = sensor.measurement.canonical(z[None])
        return bool(_density(sensor, one)[0] > least if least else np.all(sensor.covers(one)))

    lines, which, sides = zip(*(_cells(sensor, inside, start, i, axis) for i, axis in enumerate(axes)), strict=True)
    grid = sensor.measurement.canonical(np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, len(axes)))
    density = _density(sensor, grid).reshape([len(line) for line in lines]) * np.prod(sides)
    found = float(np.sum(density))
    closed_if(found - np.sum(density[which]) > 0.01 * found, "what it covers is no box along its axes")
    closed_if(not found and not np.any(sensor.covers(grid)), "it covers nothing where the kit looks")
    closed_if(found == wanted == 0, "it has no false returns")
    otherwise = f"clutter: integrates to {found:.4g} false returns in a scan, clutter_per_scan says {wanted:g}"
    demand(abs(found - wanted) <= 0.03 * wanted, otherwise)


def clutter_spreads_over_what_may_lack(sensor: Sensor, drawn: Looks) -> None:
    """If returns may lack an axis: along it the density integrates to that at a place times the length that is stated."""
    closed_if(not sensor.optional, Unlike("its returns lack no axis"))
    names, covers, z = sensor.measurement.names, sensor.covers, _where_it_is_dense(sensor, drawn)
    for name, length in sensor.optional.items():
        demand(name in names, f"optional: {name!r} is none of what it measures, {', '.join(names)}")
        demand(0 < length < np.inf, f"optional: the length of {name} must be finite and > 0, got {length:g}")
        i = names.index(name)
        line, _, side = _cells(sensor, lambda one: bool(np.all(covers(one[None]))), z, i, sensor.measurement.axes[i])
        along = sensor.measurement.canonical(np.where(np.arange(len(z)) == i, line[:, None], z))
        here, density = float(_density(sensor, z[None])[0]), _density(sensor, along)
        found = side * float(np.sum(density) / here if here else np.sum(covers(along)))
        demand(abs(found - length) <= 0.06 * found, f"optional: of {name} clutter lies over {found:.4g}, not {length:g}")


def _density(sensor: Sensor, z: Array) -> Array:
    """Return the density of false returns at each of z (k, m), 0 where the sensor covers nothing."""
    return np.where(sensor.covers(z), sensor.clutter(z), np.zeros(len(z)))


def _where_it_is_dense(sensor: Sensor, drawn: Looks) -> Array:
    """Return where most false returns lie, of the places that are tried; a covered one if there are none."""
    with np.errstate(all="ignore"):
        seen = [sensor.measure(drawn.x * shrink) for shrink in (1.0, 0.1, 0.01)]
    tried = np.concatenate([*seen, drawn.z, drawn.z * 0.01])
    tried = tried[np.all(np.isfinite(tried), axis=-1)]
    return np.array(tried[int(np.argmax(np.where(sensor.covers(tried), _density(sensor, tried), -1.0)))])


def _cells(sensor: Sensor, inside: Callable[[Array], bool], start: Array, i: int, axis: Axis) -> tuple[Array, slice, float]:
    """Return the middles of cells along axis i, those of them in which false returns lie, and how long a cell is.

    Its parameters `min_*` and `max_*` tell where they lie, or where the line along the axis through `start` is not `inside`
    any more: beyond such an end is one cell more. Closed if there is none.
    """
    word = axis.name.rpartition("_")[2]  # the largest range_rate is max_rate
    most = getattr(sensor, f"max_{axis.name}", None) or getattr(sensor, f"max_{word}", None)
    most = most if axis.period is None else axis.period / 2
    high = _end(inside, start, i, axis, 1.0) if most is None else float(most)
    if axis.name == "range" or (most is not None and axis.period is None):
        low = float(getattr(sensor, f"min_{axis.name}", 0.0 if axis.name == "range" else -high))
    else:
        low = _end(inside, start, i, axis, -1.0) if most is None else -high
    n = max(CELLS[len(start)], BEARINGS if axis.name == "bearing" else 0)
    above = int(most is None and axis.unit != "rad")  # beyond an elevation of 90 degrees there is nothing
    below = above if axis.name != "range" else 0
    side = (high - low) / n
    return low + side * (np.arange(-below, n + above) + 0.5), slice(below, n + below), side


def _end(inside: Callable[[Array], bool], start: Array, i: int, axis: Axis, sign: float) -> float:
    """Return where the line along axis i through `start` ends, towards one side."""

    def dense(step: float) -> bool:
        return inside(start + sign * step * (np.arange(len(start)) == i))

    if axis.unit == "rad":  # an angle without a period is an elevation
        far = np.pi / 2 - sign * start[i]
        if dense(far - 1e-9):
            return sign * np.pi / 2
    else:
        far = 1e-3 * size(axis)
        while dense(far):
            far *= 2
            closed_if(far > FARTHEST * size(axis), f"`covers` does not say over which {axis.name} its false returns spread")
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
    _sees_none(sensor, far, f"beyond max_range, {limit:g} m")
    if "z" not in sensor.observes or "range" not in sensor.measurement:
        return
    for row, factor in enumerate((1.05, 3.0, 100.0)):  # over the sensor: near it in the plane
        far[row, places] = station + 0.1 * limit
        far[row, sensor.observes.names.index("z")] = factor * limit
    beyond = sensor.measure(far)[:, sensor.measurement.names.index("range")] > limit
    _sees_none(sensor, far[beyond], f"where it measures more than max_range, {limit:g} m")


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
    _sees_none(sensor, x, "outside of its sectors")
    if "bearing" in sensor.measurement or {"x", "y"} <= set(sensor.measurement.names):
        covered = np.any(sensor.covers(sensor.measure(x)))
        demand(not covered, "covers: must be false outside of its sectors")


def sees_nothing_where_it_covers_nothing(sensor: Sensor, drawn: Looks) -> None:
    """Where no false return may lie, no target is detected: both lie in its field of view."""
    x = np.concatenate([drawn.x, 10.0 * drawn.x, 100.0 * drawn.x])
    covered = np.broadcast_to(sensor.covers(sensor.measure(x)), len(x))
    closed_if(covered.all(), "it covers all places that were tried")
    _sees_none(sensor, x[~covered], "where `covers` is false")


def _sees_none(sensor: Sensor, x: Array, where: str) -> None:
    p = full(sensor.detects(x), x, ())
    for i in np.flatnonzero(p != 0):
        place = ", ".join(f"{axis} {value:.6g}" for axis, value in zip(sensor.observes.names, x[i], strict=True))
        raise Broken(f"detects: must be 0 {where}, got {p[i]:g} at {place}")


LAWS: tuple[Law, ...] = tuple(map(Law, (
    clutter_takes_any_number_of_returns, false_returns_add_up, clutter_spreads_over_what_may_lack,
    false_returns_spread_as_stated, detects_within_max_range, detects_within_its_sectors,
    sees_nothing_where_it_covers_nothing,
)))  # fmt: skip
