"""Finite resolution: objects that a sensor cannot tell apart give one return."""

from __future__ import annotations

import numpy as np

from vedette import Array, Indices, Mask, Sensor, Space, kernels
from vedette.sampling import returns


def merged_returns(
    sensor: Sensor, x: Array, uniform: Array, standard: Array, cells: Array | None, rng: np.random.Generator | None = None
) -> tuple[Array, Mask]:
    """Return what `sensor` reports of objects x (t, n) when returns merge: z (t, m), valid (t,).

    Each object is detected as in `returns`. Two that are detected are unresolved if h(x) differs by less than the cell
    (m,) on every axis, or without cells with the probability that the sensor states, by `rng`; so are those that a chain of
    such pairs connects. Such a group gives the return of its first
    member, moved to the mean of the members' h(x): the error is that of one return. An infinite cell leaves its axis out.
    Svensson, Ulmke, Hammarstrand, Multitarget Sensor Resolution Model and JPDA, IEEE T-AES 48, 2012 (groups as graphs);
    Chang, Bar-Shalom, JPDA for Multitarget Tracking with Possibly Unresolved Measurements, IEEE T-AC 29, 1984 (cells).
    """
    z, seen = returns(sensor, x, uniform, standard)
    seen = np.broadcast_to(seen, len(x)).copy()
    rows = np.flatnonzero(seen)
    if len(rows) < 2:
        return z, seen
    space = sensor.measurement
    exact = np.broadcast_to(sensor.measure(x), z.shape)[rows]
    if cells is None:
        assert rng is not None
        group = _drawn_groups(sensor, x[rows], exact, rng)
    else:
        group = _groups(exact, cells, space)
    first = rows[np.unique(group, return_index=True)[1]][group]
    shift = space.difference(exact, np.asarray(sensor.measure(x))[first])
    total = np.zeros((int(group.max()) + 1, z.shape[-1]))
    np.add.at(total, group, shift)
    mean = total / np.bincount(group)[:, None]
    seen[rows] = first == rows
    z = z.copy()
    leads = rows[first == rows]
    z[leads] = space.displace(z[leads], mean[group[first == rows]])
    return z, seen


def _drawn_groups(sensor: Sensor, x: Array, h: Array, rng: np.random.Generator) -> Indices:
    """Return the number of the group of each of x (t, n): pairs merge with the probability that the sensor states."""
    C, itself = np.asarray(sensor.unresolved(x)), np.arange(len(h))
    i, j = np.triu_indices(len(h), 1)
    d = sensor.measurement.difference(h[j], h[i])
    square = np.sum(d * np.linalg.solve(np.broadcast_to(C, (len(h), *C.shape[-2:]))[i], d[..., None])[..., 0], axis=-1)
    merge = rng.random(len(i)) < np.exp(-0.5 * square)
    return kernels.linked_clusters(np.append(i[merge], itself), np.append(j[merge], itself), len(h), len(h))[: len(h)]


def _groups(h: Array, cells: Array, space: Space) -> Indices:
    """Return the number of the group of each of h (t, m): two are connected if nearer than the cell on every axis."""
    t, reach = len(h), np.nextafter(cells, 0.0)
    near = kernels.pairs_in_boxes(h - reach, h + reach, h, space.periods, t * t)
    return kernels.linked_clusters(*near, t, t)[:t]
