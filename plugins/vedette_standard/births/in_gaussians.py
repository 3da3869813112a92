"""Places in the plane as Gaussians have them, counted from 0 to 1 along axes on which they are independent."""

from __future__ import annotations

import numpy as np

from vedette import Array, Gaussian, Mask, Sensor, Space, kernels
from vedette_standard.births.cells import middles, moved
from vedette_standard.regions import PLANE

POINTS = 64
"""About so many places, over all axes that a sensor observes, of which those beside the plane are averaged."""


def plane(state: Space) -> list[int]:
    """Return the axes of the plane in a state; of one that has none, the first."""
    return [state.names.index(name) for name in PLANE.names if name in state] or [0]


def detection(prior: Gaussian, state: Space, sensor: Sensor, places: Array) -> Array:
    """Return the probability that a sensor detects what is at places (c, .., d) of Gaussians (c, n), (c, ..); or ()."""
    own, flat = state.locate(sensor.observes), plane(state)
    detects: Array = sensor.detects(prior.mean[:, own])
    if detects.ndim == 0:
        return detects
    from scipy.special import ndtri

    rest = [axis for axis in own if axis not in flat]
    axes, count = [*flat, *rest], round(POINTS ** (1 / (len(flat) + len(rest))))
    inner = middles(count, len(rest)) if rest else np.zeros((1, 0))
    shape = (*places.shape[:-1], len(inner))
    at = np.concatenate(
        [np.broadcast_to(places[..., None, :], (*shape, len(flat))), np.broadcast_to(inner, (*shape, len(rest)))], axis=-1
    )
    lead = (len(prior.mean), *[1] * (at.ndim - 2))
    root = kernels.root(prior.cov[:, axes][..., axes]).reshape(*lead, len(axes), len(axes))
    offsets = (root @ ndtri(at)[..., None])[..., [axes.index(axis) for axis in own], 0]
    return np.asarray(
        np.mean(sensor.detects(sensor.observes.displace(prior.mean[:, own].reshape(*lead, -1), offsets)), axis=-1)
    )


def counted_along(prior: Gaussian, state: Space, mean: Array) -> Array:
    """Return where states (c, k, n) are in Gaussians (c, n), (c, k, d)."""
    from scipy.special import ndtr

    flat = plane(state)
    inverse = np.linalg.pinv(kernels.root(prior.cov[:, flat][..., flat]))
    return np.asarray(ndtr((inverse[:, None] @ (mean - prior.mean[:, None])[..., flat, None])[..., 0]))


def mixed_by_motion(number: Array, prior: Gaussian, state: Space, dt: float) -> Array:
    """Return the numbers in cells (c, n, .., n) of Gaussians after dt s, by the velocities that go with each place."""
    from scipy.special import ndtri

    flat = plane(state)
    names = [f"v{state.names[axis]}" for axis in flat]
    if not all(name in state for name in names):
        return number
    own = [state.names.index(name) for name in names]
    inverse = np.linalg.pinv(kernels.root(prior.cov[:, flat][..., flat]))
    cross = prior.cov[:, own][..., flat] @ np.swapaxes(inverse, -1, -2)
    left = prior.cov[:, own][..., own] - cross @ np.swapaxes(cross, -1, -2)
    speeds = np.sqrt(np.maximum(np.diagonal(inverse @ left @ np.swapaxes(inverse, -1, -2), axis1=-2, axis2=-1), 0.0))
    for axis in range(len(flat)):
        number = moved(number, axis, speeds[:, axis] * dt, lambda q: np.exp(-0.5 * ndtri(q) ** 2) / np.sqrt(2.0 * np.pi))
    return number


def pairs_alike(prior: Gaussian, state: Space, most: float) -> Mask:
    """Return which of Gaussians (c, n) is like the next one (c-1,), and no next one's next.

    They are alike if the moments of both, halves each, are larger than theirs by a factor of e^most at most, as a volume.
    """
    apart = state.difference(prior.mean[1:], prior.mean[:-1])
    both = 0.5 * (prior.cov[1:] + prior.cov[:-1]) + 0.25 * apart[:, :, None] * apart[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        size = 0.5 * np.linalg.slogdet(prior.cov)[1]
        near = 0.5 * np.linalg.slogdet(both)[1] - 0.5 * (size[1:] + size[:-1]) < most
    near[1::2] = False
    return np.asarray(near)
