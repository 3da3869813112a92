"""False returns, drawn where a sensor's clutter has its density."""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

import numpy as np
from attrs import frozen

from vedette import fields
from vedette.roles import Sensor
from vedette.space import Array, Mask, Space

_MOST = 1e6
"""More clutter than this in a scan is taken for a wrong unit."""

_FINER = 6
"""How often the grid for the greatest density is made finer, each time by 4."""


@final
@frozen
class Bounds:
    """Limits on one axis of a measurement space."""

    low: float = fields.quantity("1", "least value, in the axis' own unit")
    high: float = fields.quantity("1", "greatest value, in the axis' own unit")

    def __attrs_post_init__(self) -> None:
        if not self.low < self.high:
            raise ValueError(f"high: must be > low = {self.low:.6g}, got {self.high:.6g}")


def corners(measurement: Space, region: Mapping[str, Bounds]) -> tuple[Array, Array]:
    """Return the box that a region names.

    Parameters
    ----------
    measurement
        The measured axes.
    region
        Measured axis to its limits in the axis' unit. An axis that wraps may be left out for all of it.

    Returns
    -------
    tuple of arrays
        The lowest corner (m,) and the highest (m,).

    Raises
    ------
    ValueError
        If an axis is missing or unknown, or a range is longer than the period.
    """
    if unknown := [name for name in region if name not in measurement]:
        raise ValueError(f"{unknown[0]}: is not measured; the measured axes are {measurement}")
    box = []
    for axis in measurement.axes:
        if axis.name in region:
            low, high = region[axis.name].low, region[axis.name].high
            if axis.period is not None and high - low > axis.period * (1 + 1e-12):
                raise ValueError(f"{axis.name}: must span at most {axis.period:.6g} {axis.unit}, got {high - low:.6g}")
        elif axis.period is not None:
            low, high = -0.5 * axis.period, 0.5 * axis.period
        else:
            raise ValueError(f"{axis.name}: must have a low and a high; the measured axes are {measurement}")
        box.append((low, high))
    lows, highs = np.array(box).T
    return lows, highs


def densities(sensor: Sensor, z: Array) -> Array:
    """Return a sensor's clutter density at given places, 0 where its field of view does not hold them.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    z
        Measurements (*b, m).

    Returns
    -------
    array
        False returns a scan in 1 / volume of the measurement space (*b).

    Raises
    ------
    ValueError
        If one of them is negative or not finite.
    """
    return np.where(sensor.covers(sensor.measurement.canonical(z)), _stated(sensor, z), 0.0)


def _stated(sensor: Sensor, z: Array) -> Array:
    """Return the density (*b) that a sensor states at places (*b, m), whether it covers them or not."""
    density = np.broadcast_to(sensor.clutter(sensor.measurement.canonical(z)), z.shape[:-1])
    if not np.all((density >= 0) & np.isfinite(density)):
        raise ValueError(f"{sensor.kind}: its clutter density must be finite and >= 0, got {np.min(density):.6g}")
    return density


def ceiling(sensor: Sensor, lows: Array, highs: Array) -> float:
    """Return a bound of the clutter density in a box: its greatest value on a grid, plus a quarter if it varies.

    The grid is made finer around its greatest value, for densities that peak, as at a radar.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    lows, highs
        The corners of the box (m,), as `corners` returns them.

    Returns
    -------
    float
        In 1 / volume of the measurement space.

    Raises
    ------
    ValueError
        If it makes more returns than a scene can have.
    """
    z, density = _gridded(sensor, lows, highs)
    top, least, half = float(np.max(density)), float(np.min(density)), 0.5 * (highs - lows)
    for _ in range(_FINER if least < top else 0):
        half = half / 4
        peak = z[np.argmax(density)]
        z, density = _gridded(sensor, np.maximum(peak - half, lows), np.minimum(peak + half, highs))
        if np.max(density) <= top:
            break
        top = float(np.max(density))
    bound = top if least == top else 1.25 * top
    if (count := bound * float(np.prod(highs - lows))) > _MOST:
        raise ValueError(f"{sensor.kind}: {count:.3g} false returns a scan; check the density's unit and the region")
    return bound


def _gridded(sensor: Sensor, lows: Array, highs: Array) -> tuple[Array, Array]:
    """Return a grid over the box (g, m), its corners included, and the clutter density there (g,)."""
    m = len(lows)
    sides = np.meshgrid(*np.linspace(lows, highs, max(3, int(4096 ** (1 / m))), axis=-1), indexing="ij")
    z = np.stack(sides, axis=-1).reshape(-1, m)
    return z, _stated(sensor, z)


def thinned(sensor: Sensor, z: Array, uniform: Array, bound: float, candidate: Mask) -> Mask:
    """Return which of the candidates of a uniform process stay: each with probability density / `bound`.

    Lewis, Shedler, Simulation of nonhomogeneous Poisson processes by thinning, Naval Research Logistics 26, 1979.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    z
        Candidates (*b, k, m).
    uniform
        Numbers in [0, 1), (*b, k).
    bound
        The density of the candidates, in 1 / volume of the measurement space.
    candidate
        Which of z are candidates (*b, k); the others are padding.

    Returns
    -------
    array
        True for those that stay (*b, k).

    Raises
    ------
    ValueError
        If a candidate lies where the density is above the bound, as at a narrow peak: that would be a wrong draw.
    """
    density = densities(sensor, z)
    if np.any((density > bound) & candidate):
        raise ValueError(f"{sensor.kind}: its clutter density peaks too sharply for this region; state a smaller one")
    return candidate & (uniform * bound < density)


def draw_clutter(
    sensor: Sensor, region: Mapping[str, Bounds], rng: np.random.Generator, size: tuple[int, ...] = ()
) -> tuple[Array, Mask]:
    """Draw a sensor's clutter: a Poisson process with the density that it states, exact for any density.

    Parameters
    ----------
    sensor
        The sensor, placed if it stands on a platform.
    region
        Measured axis to the limits within which clutter is drawn, in the axis' unit.
    rng
        The generator that is drawn from.
    size
        Batch axes: so many scans are drawn at once.

    Returns
    -------
    tuple of arrays
        Returns z (*size, k, m), and which of them are valid (*size, k).

    Raises
    ------
    ValueError
        If the region is wrong, or the density is none, peaks too sharply, or makes more returns than a scene can have.
    """
    lows, highs = corners(sensor.measurement, region)
    bound, volume = ceiling(sensor, lows, highs), float(np.prod(highs - lows))
    counts = np.asarray(rng.poisson(bound * volume, size))
    k = int(np.max(counts, initial=0))
    z = lows + (highs - lows) * rng.random((*size, k, len(lows)))
    kept = thinned(sensor, z, rng.random((*size, k)), bound, np.arange(k) < counts[..., None])
    return sensor.measurement.canonical(z), kept
