"""Returns that follow one another at speeds which targets have: what tracks of two scans and of three begin with."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np
from attrs import frozen

from vedette import Array, Detections, Gaussian, Indices, Sensor, Space


@frozen(eq=False)
class Waiting:
    """Positions (k, d) and covariances (k, d, d) of returns that no track claimed, in the scan `ago` () s before."""

    mean: Array
    cov: Array
    ago: Array

    def later(self, dt: float) -> Waiting:
        """Return the same returns, `dt` longer ago."""
        return Waiting(self.mean, self.cov, self.ago + dt)

    @property
    def idle(self) -> bool:
        """Whether there is none of an earlier time."""
        return bool(self.ago == 0) or not len(self.mean)


@cache
def nothing(axes: int) -> Waiting:
    """Return no return of a scan just now."""
    return Waiting(np.zeros((0, axes)), np.zeros((0, axes, axes)), np.asarray(0.0))


def spots(sensor: Sensor, detections: Detections, rows: Indices) -> Gaussian:
    """Return the positions (k, d) that some returns give."""
    return sensor.invert(detections.z[rows], None if detections.noise is None else detections.noise[rows])


def fastest(most: float, by_sensor: Mapping[str, float], by_class: Array, name: str, detections: Detections) -> Array:
    """Return the speed limit (k,) of each return: its sensor's, or `most`; its class's, if that has one and is lower."""
    limit = np.full(len(detections.z), by_sensor.get(name, most))
    if not len(by_class) or detections.identity is None:
        return limit
    known = (detections.identity >= 0) & (detections.identity < len(by_class))
    return np.where(known, np.minimum(limit, by_class[np.where(known, detections.identity, 0)]), limit)


def pairs(now: Gaussian, before: Waiting, limit: Array, deviations: float) -> tuple[Indices, Gaussian]:
    """Return which positions (k, d) follow one of the scan before, and position and velocity (j, 2d) of these.

    Two-point differencing: z2 and z1, dt apart, give z2 and (z2 - z1) / dt, with the covariances R2, (R1 + R2) / dt^2 and
    R2 / dt between them. limit (k,): the fastest, beyond which `deviations` of the noise are allowed; the nearest counts.
    """
    apart = np.linalg.norm(now.mean[:, None] - before.mean[None], axis=-1)
    nearest = np.argmin(apart, axis=-1)
    noise = np.sqrt(np.linalg.eigvalsh(now.cov + before.cov[nearest])[..., -1])
    near = np.flatnonzero(np.min(apart, axis=-1) <= limit * before.ago + deviations * noise)
    nearest, spot = nearest[near], Gaussian(now.mean[near], now.cov[near])
    d, dt = spot.mean.shape[-1], before.ago
    mean = np.concatenate([spot.mean, (spot.mean - before.mean[nearest]) / dt], axis=-1)
    cov = np.empty((len(near), 2 * d, 2 * d))
    cov[:, :d, :d] = spot.cov
    cov[:, :d, d:] = cov[:, d:, :d] = spot.cov / dt
    cov[:, d:, d:] = (spot.cov + before.cov[nearest]) / dt**2
    return near, Gaussian(mean, cov)


def in_state(found: Gaussian, position: Space, spread: Mapping[str, float], state: Space) -> Gaussian:
    """Return positions and velocities (j, 2d) as beliefs over a state: other axes are 0 with deviations of `spread`."""
    own, n = [*state.locate(position), *velocity_axes(position, spread, state)], len(state)
    mean, cov = np.zeros((len(found.mean), n)), np.zeros((len(found.mean), n, n))
    cov[:, range(n), range(n)] = [spread.get(axis, 0.0) ** 2 for axis in state.names]
    mean[:, own] = found.mean
    cov[:, np.array(own)[:, None], own] = found.cov
    return Gaussian(mean, cov)


def velocity_axes(position: Space, spread: Mapping[str, float], state: Space) -> list[int]:
    """Return the axes of the velocity, one for each of the position; ValueError if the state lacks one or has others."""
    names = [f"v{name}" for name in position.names]
    if lacking := [name for name in names if name not in state]:
        raise ValueError(f"sensors: must observe positions with a velocity in the state, which lacks {lacking[0]!r}")
    if lacking := [name for name in state.names if name not in {*names, *position.names, *spread}]:
        raise ValueError(f"spread: must state the standard deviation of {', '.join(map(repr, lacking))} in new tracks")
    return [state.names.index(name) for name in names]
